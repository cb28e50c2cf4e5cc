"""The hand-crafted gait as a policy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.env import RotationEnv
from tactile_cube.evaluation.episode_record import Array
from tactile_cube.hand import Gait


class ScriptedPolicy:
    """Plays the gait in the rewarded direction."""

    def __init__(self, gait: Gait | None = None) -> None:
        self._gait = gait or Gait()

    def start(self, env: RotationEnv, seed: int) -> None:
        """Remember hand and direction."""
        self._hand, self._direction = env.hand, env.task.direction

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the action of the clock's step."""
        return self._gait.action(self._hand, step, self._direction)
