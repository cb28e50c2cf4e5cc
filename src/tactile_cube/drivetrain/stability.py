"""Whether the damping of the torque loop is stable at the step of the physics, with the numbers if it is not."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh

from tactile_cube.drivetrain.constants import DrivetrainConstants
from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import RigidBodyTree

Array = npt.NDArray[np.float64]
BOUND = 2.0
MOST_CORNERS = 64


def damping_number(tree: RigidBodyTree, constants: DrivetrainConstants, dt: float, q: Array) -> float:
    """Stability number dt * eig_max((M(q) + I)^-1 K_D), with the damping at the joint; explicit steps need less than 2.

    Source: hand.md's trial on this hand; explicit Euler on M v' = -K_D v.
    """
    n = len(tree.joint_names)
    M = tree.actuated_mass_matrix(q) + np.diag(np.broadcast_to(constants.reflected_inertia, n))
    damping = np.broadcast_to(np.maximum(constants.kd, constants.damping_gain), n)
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
