"""The hand-crafted gait as a policy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.plain_yaml import read_yaml
from tactile_cube.env import RotationEnv
from tactile_cube.errors import InputError
from tactile_cube.evaluation.episode_record import Array
from tactile_cube.hand import Gait


class ScriptedPolicy:
    """Plays the gait in the rewarded direction."""

    def __init__(self, gait: Gait | None = None) -> None:
        self._gait = gait or Gait()

    @classmethod
    def from_file(cls, path: Path) -> ScriptedPolicy:
        """The best gait of a file that `benchmarks.teacher` wrote.

        Raises:
            InputError: it cannot be read, or holds no gait.
        """
        try:
            best = read_yaml(path)["best"]
            return cls(Gait(**best | {"phases": tuple(best["phases"])}))
        except (KeyError, TypeError) as error:
            raise InputError(f"policy=scripted:{path}: no gait of search_gait (key 'best')") from error

    def start(self, env: RotationEnv, seed: int) -> None:
        """Remember hand and direction."""
        self._hand, self._direction = env.hand, env.task.direction

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the action of the clock's step."""
        return self._gait.action(self._hand, step, self._direction)
