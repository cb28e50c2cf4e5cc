"""Tells physics that has failed from physics that has not: numbers, speeds and overlaps within generous bounds.

In ordinary episodes joints stay below 3 rad/s, contact forces below 12 N and overlaps below 1 mm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MAX_JOINT_SPEED = 60.0
"""[rad/s]; the drives reach about 6."""
MAX_CUBE_SPEED = 5.0
"""[m/s]; half a second of free fall."""
MAX_CUBE_SPIN = 100.0
"""[rad/s]."""
MAX_OVERLAP = 6e-3
"""Deepest overlap of two bodies [m]; a fingertip's radius is 14 mm."""
MAX_TENDON_STRETCH = 0.3
"""Largest difference between q4 and q3 [rad]."""


def find_fault(q: Array, v: Array, cube: Array, distances: Sequence[float]) -> str:
    """What is wrong with a state, in a few words; "" if nothing.

    Args:
        q: Angles of all joints (fingers, 4) [rad].
        v: Their velocities (fingers, 4) [rad/s].
        cube: Position, quaternion, linear and angular velocity (13,).
        distances: Gaps of the contact points [m], negative where bodies overlap.
    """
    if not (np.isfinite(q).all() and np.isfinite(v).all() and np.isfinite(cube).all()):
        return "not a number"
    readings = (
        ("joint speed", float(np.abs(v).max()), MAX_JOINT_SPEED, "rad/s"),
        ("cube speed", float(np.abs(cube[7:10]).max()), MAX_CUBE_SPEED, "m/s"),
        ("cube spin", float(np.abs(cube[10:13]).max()), MAX_CUBE_SPIN, "rad/s"),
        ("overlap", -min(distances, default=0.0), MAX_OVERLAP, "m"),
        ("tendon stretch", float(np.abs(q[:, 3] - q[:, 2]).max()), MAX_TENDON_STRETCH, "rad"),
    )
    for name, value, bound, unit in readings:
        if value > bound:
            return f"{name} {value:.3g} {unit} above {bound:g}"
    return ""
