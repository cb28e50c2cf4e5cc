"""What a command to the hand never exceeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError

Array = NDArray[np.float64]
RATE = 6.28
"""Largest change of a desired angle [rad/s]. Source: data sheet of the hand, about 360 deg/s."""


def require_positive(numbers: Mapping[str, float]) -> None:
    """Refuse a setting that is no finite number above 0.

    Args:
        numbers: key of the configuration -> its value.

    Raises:
        InputError: one of them bounds nothing, or everything.
    """
    for key, value in numbers.items():
        if not (isinstance(value, (int, float)) and 0 < value < inf):
            raise InputError(f"{key} is {value}; give a finite number above 0")


@dataclass(frozen=True)
class Limits:
    """Range, rate and torque of the desired angles.

    Attributes:
        lower: `(joints,)` [rad].
        upper: `(joints,)` [rad].
        rate: largest change of a desired angle [rad/s].
        torque: largest torque K_P (q_d - q_m) that a command may demand [N m].
        kp: stiffness of the impedance law `(joints,)` [N m/rad].
        kd: its damping `(joints,)` [N m s/rad]; it only brakes, so no limit depends on it.

    Raises:
        InputError: a limit that bounds nothing.
    """

    lower: Array
    upper: Array
    rate: float
    torque: float
    kp: Array
    kd: Array

    def __post_init__(self) -> None:
        """Refuse limits that bound nothing."""
        require_positive({"rate_limit": self.rate, "torque_limit": self.torque})
        if not (self.lower <= self.upper).all():
            raise InputError(f"joint range {self.lower} to {self.upper} [rad]; a lower limit is above an upper one")
        if not ((self.kp >= 0) & (self.kp < inf)).all():
            raise InputError(f"kp is {self.kp} N m/rad; give finite numbers of 0 or more")

    @property
    def reach(self) -> Array:
        """How far a command may be from the measured angle: torque / K_P `(joints,)` [rad], inf without stiffness."""
        return np.asarray(np.divide(self.torque, self.kp, out=np.full(self.kp.shape, inf), where=self.kp > 0))
