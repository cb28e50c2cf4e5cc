"""From the equations of all joints of a finger to those of its actuated ones, and back to torques of all links."""

import numpy as np
import numpy.typing as npt

from tactile_cube.compiled import compiled

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@compiled
def expand(follow: Integers, ratio: Array, offset: Array, q: Array, v: Array, q_all: Array, v_all: Array) -> None:
    """Positions and speeds of all dofs (N,) from those of the actuated joints (n,)."""
    for k in range(len(follow)):
        q_all[k] = ratio[k] * q[follow[k]] + offset[k]
        v_all[k] = ratio[k] * v[follow[k]]


@compiled
def reduce_equations(
    follow: Integers, ratio: Array, M: Array, h: Array, rotor: Array, M_joint: Array, h_joint: Array
) -> None:
    """J^T M J + diag(rotor) (n, n) and J^T h (n,): the reflected inertia enters in joint space."""
    M_joint[:] = 0.0
    h_joint[:] = 0.0
    for k in range(len(follow)):
        h_joint[follow[k]] += ratio[k] * h[k]
        for i in range(len(follow)):
            M_joint[follow[k], follow[i]] += ratio[k] * ratio[i] * M[k, i]
    for j in range(len(rotor)):
        M_joint[j, j] += rotor[j]


@compiled
def estimate_contact(
    follow: Integers, ratio: Array, M: Array, h: Array, torque: Array, acceleration: Array, limit: float, contact: Array
) -> None:
    """J^T c with c = M a + h - tau of the previous step: what else than our torque moved the joints.

    Clipped at `limit` [N m], because an impact within one step is not a torque that lasts.
    """
    contact[:] = 0.0
    for k in range(len(follow)):
        other = h[k] - torque[k]
        for i in range(len(follow)):
            other += M[k, i] * acceleration[i]
        contact[follow[k]] += ratio[k] * other
    for j in range(len(contact)):
        contact[j] = min(max(contact[j], -limit), limit)


@compiled
def link_torques(
    follow: Integers,
    leader: Integers,
    ratio: Array,
    M: Array,
    h: Array,
    acceleration: Array,
    contact: Array,
    torque: Array,
) -> None:
    """Torques (N,) under which the engine's links, inertia M and bias h, get the wanted joint accelerations (n,).

    `contact` (n,) is taken off the actuated joints, the dofs `leader` (n,): the engine's solver adds it itself.
    """
    for k in range(len(follow)):
        torque[k] = h[k]
        for i in range(len(follow)):
            torque[k] += M[k, i] * ratio[i] * acceleration[follow[i]]
    for j in range(len(leader)):
        torque[leader[j]] -= contact[j]


@compiled
def add_tendons(
    follow: Integers,
    leader: Integers,
    ratio: Array,
    offset: Array,
    q: Array,
    v: Array,
    stiffness: float,
    damping: float,
    torque: Array,
) -> None:
    """Adds the spring that keeps each coupled dof at its place; it carries what contacts do to the coupled link.

    Args:
        follow: (N,) actuated joint of each dof.
        leader: (n,) dof of each actuated joint.
        ratio: (N,).
        offset: (N,) [rad].
        q: (N,) [rad].
        v: (N,) [rad/s].
        stiffness: [N m/rad].
        damping: [N m s/rad].
        torque: (N,) changed in place [N m].
    """
    for k in range(len(follow)):
        first = leader[follow[k]]
        if first != k:
            stretch = ratio[k] * q[first] + offset[k] - q[k]
            pull = stiffness * stretch + damping * (ratio[k] * v[first] - v[k])
            torque[k] += pull
            torque[first] -= ratio[k] * pull
