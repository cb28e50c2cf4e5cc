"""The constants of a drivetrain, one number for all joints or one per joint."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from itertools import product
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh

from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import RigidBodyTree

Array = npt.NDArray[np.float64]
PerJoint = float | tuple[float, ...] | Array
_POSITIVE = ("stiffness", "torque_limit", "rate_limit")


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
        for name in [entry.name for entry in fields(self) if entry.name != "sign"]:
            value, positive = getattr(self, name), name in _POSITIVE
            try:
                numbers = np.asarray(value, dtype=float)
            except (TypeError, ValueError):
                raise InputError(f"drivetrain {name} is {value!r}; give a number or one per joint") from None
            if numbers.ndim > 1 or not np.all(numbers > 0 if positive else numbers >= 0):
                wanted = "positive" if positive else "non-negative"
                raise InputError(f"drivetrain {name} is {value}; give {wanted} numbers")
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


BOUND = 2.0
MOST_CORNERS = 64


def damping_number(tree: RigidBodyTree, constants: DrivetrainConstants, dt: float, q: Array) -> float:
    """Stability number dt * eig_max((M(q) + I)^-1 K_D), with the damping at the joint; explicit steps need less than 2.

    Source: hand.md's trial on this hand; explicit Euler on M v' = -K_D v.
    """
    n = len(tree.joint_names)
    M = tree.actuated_mass_matrix(q) + np.diag(np.broadcast_to(constants.reflected_inertia, n))
    reaching = constants.kd / (1.0 + constants.compliance * np.asarray(constants.kp))  # through the elasticity
    damping = np.broadcast_to(np.maximum(constants.kd, reaching), n)
    return float(dt * eigh(np.diag(damping), M, eigvals_only=True)[-1])


def check_damping_stability(
    tree: RigidBodyTree, constants: DrivetrainConstants, dt: float, poses: Iterable[npt.ArrayLike] | None = None
) -> float:
    """The largest damping number over poses (n,); by default zero and the corners of the joints' range.

    Raises:
        InputError: it reaches 2: the simulation would diverge.
    """
    worst = max(damping_number(tree, constants, dt, np.asarray(q, dtype=float)) for q in poses or _corners(tree))
    if worst >= BOUND:
        raise InputError(
            f"drivetrain: K_D dt eig_max(M^-1) = {worst:.2f} must stay below 2 (kd {_text(constants.kd)} N m s/rad, dt "
            f"{dt:g} s, reflected_inertia {_text(constants.reflected_inertia)} kg m^2); lower kd or dt, or raise "
            "reflected_inertia"
        )
    return worst


def _corners(tree: RigidBodyTree) -> list[Array]:
    own = [tree.dof_names.index(name) for name in tree.joint_names]
    ends = [(tree.lower[k], tree.upper[k]) for k in own]
    zero = np.zeros(len(own))
    if 2 ** len(own) > MOST_CORNERS or not np.all(np.isfinite(ends)):
        return [zero]
    return [zero, *(np.array(corner) for corner in product(*ends))]


def _text(value: object) -> str:
    return " ".join(f"{number:g}" for number in np.atleast_1d(np.asarray(value, dtype=float)))
