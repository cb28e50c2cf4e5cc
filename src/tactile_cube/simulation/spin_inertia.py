"""What keeps Bullet's explicit torque steps stable: spin inertia on the links and a spring for the tendon.

Both are numerical aids. The control step knows them and gives torques under which the joints move as if the rotors'
inertia sat in joint space and the tendon were rigid.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.hand import Hand
from tactile_cube.hand.rigid_body import RigidBodyTree

Array = NDArray[np.float64]

LEAST_INERTIA = 1e-3
"""Reflected inertia below which spin inertia is not lowered further [kg m^2]."""
TENDON_STIFFNESS = 15.0
"""Spring that holds q4 at q3 [N m/rad]."""
TENDON_DAMPING = 0.02
"""Its damping [N m s/rad]; stable while k dt^2 w + 2 d dt w < 4 with w = (J3 + 4 J4) / (J3 J4)."""


PARALLEL = 0.99
"""Cosine of the angle between axes from which on they count as parallel."""


def spin_inertia(hand: Hand, shares: Array, reflected_inertia: Array) -> Array:
    """Spin inertia of each link about its joint (fingers, links), from I_a of the joints (joints,) [kg m^2]."""
    return np.asarray(np.maximum(hand.all_angles(reflected_inertia), LEAST_INERTIA) * shares)


def spin_shares(tree: RigidBodyTree) -> Array:
    """Share of a joint's reflected inertia that its link spins with (links,).

    Joints in a row with parallel axes share it, for all further links turn with the first of them: three of them take
    1/2, 1/3 and 1/6.
    """
    groups: list[int] = []
    turn, before = np.eye(3), np.zeros(3)
    for k in range(tree.dofs):
        turn = turn @ tree.placement_rotation[k]
        axis = turn @ tree.axis[k]
        if groups and abs(float(axis @ before)) > PARALLEL:
            groups[-1] += 1
        else:
            groups.append(1)
        before = axis
    return np.concatenate([np.arange(count, 0, -1) / (count * (count + 1) // 2) for count in groups])
