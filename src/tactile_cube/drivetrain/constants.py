"""The constants of a drivetrain, one number for all joints or one per joint."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
import numpy.typing as npt

from tactile_cube.errors import InputError

Array = npt.NDArray[np.float64]
PerJoint = float | tuple[float, ...] | Array


@dataclass(frozen=True)
class DrivetrainConstants:
    """What turns a desired joint angle into a joint torque; the defaults are the hand's.

    Source: Sievers, Pitz, Bauml (ICRA 2022), table of the authors' website.

    Attributes:
        kp: K_P [N m/rad].
        kd: K_D [N m s/rad].
        stiffness: K_e of the drive's elasticity [N m/rad]; infinite for none.
        static_friction: F_static, dry friction of the joint [N m].
        reflected_inertia: i^2 J, the rotor seen from the joint [kg m^2].
        torque_limit: largest torque of the controller [N m].
        rate_limit: fastest change of the filtered target [rad/s].
        sign: `physical`: the motor is ahead of the link, q_m = q + tau / K_e; `printed`: eq. (2) of the paper as it
            stands, q_m = q - tau / K_e.
    """

    kp: PerJoint = 3.69
    kd: PerJoint = 0.25
    stiffness: PerJoint = 25.0
    static_friction: PerJoint = 0.02
    reflected_inertia: PerJoint = 1.5e-3
    torque_limit: PerJoint = 1.0
    rate_limit: PerJoint = np.inf
    sign: Literal["physical", "printed"] = "physical"

    def __post_init__(self) -> None:
        """Refuses values that no drive has."""
        for entry in fields(self):
            if entry.name != "sign":
                _check(entry.name, getattr(self, entry.name), positive=entry.name in _POSITIVE)
        if self.sign not in ("physical", "printed"):
            raise InputError(f"stiffness sign is '{self.sign}'; use 'physical' or 'printed'")
        if self.sign == "printed" and np.any(np.asarray(self.kp) >= np.asarray(self.stiffness)):
            raise InputError(
                f"kp {self.kp} with stiffness {self.stiffness} N m/rad is unstable with the printed sign: kp must be "
                "smaller; use sign 'physical'"
            )

    @property
    def compliance(self) -> Array:
        """(q_m - q) / tau [rad/(N m)]: 1 / K_e with the sign chosen."""
        sign = 1.0 if self.sign == "physical" else -1.0
        return sign / np.asarray(self.stiffness, dtype=float)

    @property
    def damping_gain(self) -> Array:
        """Damping that reaches the joint [N m s/rad]: the elasticity scales both gains by 1 / (1 +- K_P / K_e)."""
        return np.asarray(self.kd / (1.0 + self.compliance * np.asarray(self.kp)))


_POSITIVE = ("stiffness", "torque_limit", "rate_limit")


def _check(name: str, value: PerJoint, positive: bool) -> None:
    try:
        numbers = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"drivetrain {name} is {value!r}; give a number or one per joint") from None
    if numbers.ndim > 1 or np.any(np.isnan(numbers)) or np.any(numbers < 0) or (positive and np.any(numbers == 0)):
        raise InputError(f"drivetrain {name} is {value}; give {'positive' if positive else 'non-negative'} numbers")
