"""What a command to the hand never exceeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.target_filter import limit_rate, limit_torque

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Limits:
    """Range, rate and torque limit of the desired angles, in the order in which they are applied.

    Attributes:
        lower: `(12,)` [rad].
        upper: `(12,)` [rad].
        rate: largest change of a desired angle [rad/s].
        torque: largest torque that the impedance law may ask for [N m].
        kp: stiffness of the impedance law `(12,)` [N m/rad].
        kd: its damping `(12,)` [N m s/rad].
    """

    lower: Array
    upper: Array
    rate: float
    torque: float
    kp: Array
    kd: Array

    def apply(self, previous: Array, wanted: Array, q_m: Array, dq: Array, dt: float) -> Array:
        """Return the desired angles q_d `(12,)` [rad] nearest to the wanted ones.

        Args:
            previous: q_d of the tick before `(12,)` [rad].
            wanted: `(12,)` [rad].
            q_m: measured angles `(12,)` [rad].
            dq: measured velocities `(12,)` [rad/s].
            dt: since the tick before [s].
        """
        inside = np.clip(wanted, self.lower, self.upper)
        limited = np.empty_like(inside)
        for joint, target in enumerate(inside):
            slow = limit_rate(previous[joint], target, self.rate, dt)
            limited[joint] = limit_torque(slow, q_m[joint], dq[joint], self.kp[joint], self.kd[joint], self.torque)
        return limited
