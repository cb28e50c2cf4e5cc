"""What keeps Bullet's explicit torque steps stable: spin inertia on the links and a spring for the tendon.

Both are numerical aids. The control step knows them and gives torques under which the joints move as if the rotors'
inertia sat in joint space and the tendon were rigid.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHARES = np.array([1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 6.0])
"""Share of a joint's reflected inertia that its link spins with; q2, q3, q4 turn about parallel axes and share it."""
LEAST_INERTIA = 1e-3
"""Reflected inertia below which spin inertia is not lowered further [kg m^2]."""
TENDON_STIFFNESS = 15.0
"""Spring that holds q4 at q3 [N m/rad]."""
TENDON_DAMPING = 0.02
"""Its damping [N m s/rad]; stable while k dt^2 w + 2 d dt w < 4 with w = (J3 + 4 J4) / (J3 J4)."""


def spin_inertia(reflected_inertia: Array) -> Array:
    """Spin inertia of each link about its joint (fingers, 4) [kg m^2], from I_a of the joints (12,) [kg m^2]."""
    per_finger = np.maximum(np.asarray(reflected_inertia).reshape(-1, 3), LEAST_INERTIA)
    return np.asarray(per_finger[:, [0, 1, 2, 2]] * SHARES)
