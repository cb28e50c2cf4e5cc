"""A policy that feels less than it could: parts of its observation stay what they were when the episode began."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_cube.env import RotationEnv
from tactile_cube.errors import InputError
from tactile_cube.evaluation.episode_record import Array
from tactile_cube.evaluation.policies import Policy
from tactile_cube.hand import DLR_HAND2, Hand


def senses(hand: Hand) -> dict[str, NDArray[np.bool_]]:
    """Which of the numbers of a reading belong to each sense: measured angles, control errors, all of one finger's."""
    places = np.arange(2 * hand.joints)
    finger = places % hand.joints // hand.joints_per_finger
    own = {one.name: finger == index for index, one in enumerate(hand.fingers)}
    return {"q_m": places < hand.joints, "e_q": places >= hand.joints, **own}


class NumbPolicy:
    """Another policy whose senses are partly frozen at the first observation of the episode."""

    def __init__(self, policy: Policy, numb: Sequence[str], hand: Hand = DLR_HAND2) -> None:
        self._policy, self._numb = policy, numb_reading(numb, hand)

    def start(self, env: RotationEnv, seed: int) -> None:
        """Begin an episode."""
        self._policy.start(env, seed)

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the policy's action for what it still feels."""
        if step == 0:
            self._first = observation.copy()
        numb = np.tile(self._numb, len(observation) // len(self._numb))
        return self._policy.act(np.where(numb, self._first, observation), step)


def numb_reading(numb: Sequence[str], hand: Hand = DLR_HAND2) -> NDArray[np.bool_]:
    """Return which of the numbers of a reading are frozen.

    Raises:
        InputError: there is no such sense.
    """
    known = senses(hand)
    for name in numb:
        if name not in known:
            raise InputError(f"variant.numb has {name!r}; choose from {', '.join(known)}")
    return np.any([known[name] for name in numb], axis=0) if numb else np.zeros(2 * hand.joints, dtype=np.bool_)
