"""How the fingers get to a pose: a straight line in joint angles, then rest."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.deployment.limits import require_positive
from tactile_cube.deployment.training_setting import TrainingSetting
from tactile_cube.hand.kinematics import grasp_angles

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Homing:
    """How the fingers open, wait for the object and close: `homing` of conf/deploy.yaml [rad/s, rad, s, s, m]."""

    speed: float = 0.5
    tolerance: float = 0.05
    settle: float = 0.5
    timeout: float = 10.0
    clearance: float = 0.015

    def __post_init__(self) -> None:
        """Refuse what never arrives."""
        require_positive({f"homing.{name}": value for name, value in asdict(self).items()})


def open_angles(setting: TrainingSetting, clearance: float) -> Array:
    """Return the angles `(joints,)` [rad] with the fingertips `clearance` [m] off the object's faces."""
    known, upright = setting.constants, np.array([0.0, 0.0, 0.0, 1.0])
    size = np.asarray(known.cube_size)
    return grasp_angles(setting.hand, size, np.zeros(3), upright, clearance, known.object_shape)


class Move:
    """A straight line from `start` to `goal`, both `(joints,)` [rad], judged by what is measured."""

    def __init__(self, homing: Homing, now: float, start: Array, goal: Array) -> None:
        self._homing, self._began, self._start, self._goal = homing, now, start, goal
        self._needs = float(np.max(np.abs(goal - start))) / homing.speed
        self._in_place = now

    def target(self, now: float) -> Array:
        """Return where the fingers should be `(joints,)` [rad]."""
        return self._start + self._share(now) * (self._goal - self._start)

    def arrived(self, now: float, q_m: Array) -> bool:
        """Whether the fingers have rested at the goal for long enough."""
        if self._share(now) < 1.0 or self._away(q_m) > self._homing.tolerance:
            self._in_place = now
        return now - self._in_place >= self._homing.settle

    def failure(self, now: float, q_m: Array) -> str:
        """Return why there is nothing more to wait for; "" while there is."""
        took = now - self._began
        if took <= self._needs + self._homing.timeout:
            return ""
        return f"still {self._away(q_m):.2f} rad from the goal after {took:.0f} s"

    def _share(self, now: float) -> float:
        return 1.0 if self._needs == 0.0 else min(1.0, (now - self._began) / self._needs)

    def _away(self, q_m: Array) -> float:
        return float(np.max(np.abs(q_m - self._goal)))
