"""A policy that feels less than it could: parts of its observation stay what they were when the episode began."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_cube.env import RotationEnv
from tactile_cube.errors import InputError
from tactile_cube.evaluation.episode_record import Array
from tactile_cube.evaluation.policies import Policy
from tactile_cube.evaluation.touch import FINGERS

_JOINT = np.arange(24) % 12
SENSES: dict[str, NDArray[np.bool_]] = {
    "q_m": np.arange(24) < 12,
    "e_q": np.arange(24) >= 12,
    **{finger: np.isin(_JOINT // 3, index) for index, finger in enumerate(FINGERS)},
}
"""Which of the 24 numbers of a reading belong to each sense: measured angles, control errors, all of one finger's."""


class NumbPolicy:
    """Another policy whose senses are partly frozen at the first observation of the episode."""

    def __init__(self, policy: Policy, numb: Sequence[str]) -> None:
        self._policy, self._numb = policy, numb_reading(numb)

    def start(self, env: RotationEnv, seed: int) -> None:
        """Begin an episode."""
        self._policy.start(env, seed)

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the policy's action for what it still feels."""
        if step == 0:
            self._first = observation.copy()
        numb = np.tile(self._numb, len(observation) // len(self._numb))
        return self._policy.act(np.where(numb, self._first, observation), step)


def numb_reading(numb: Sequence[str]) -> NDArray[np.bool_]:
    """Return which of the 24 numbers of a reading are frozen.

    Raises:
        InputError: there is no such sense.
    """
    for name in numb:
        if name not in SENSES:
            raise InputError(f"variant.numb has {name!r}; choose from {', '.join(SENSES)}")
    return np.any([SENSES[name] for name in numb], axis=0) if numb else np.zeros(24, dtype=np.bool_)
