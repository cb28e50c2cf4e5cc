"""What bears the object: fingertips, or other links of the fingers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.simulation import World

TOUCH_FORCE = 0.02
"""Smallest normal force that counts as touching [N]: a twenty-fifth of the cube's weight."""
SUPPORTING_TIPS = 3
"""Fingertips that must touch the cube for it to count as supported by tips."""


def normal_forces(world: World) -> NDArray[np.float64]:
    """Normal force on the object of each finger's other links and of its tip (2, fingers) [N]."""
    fingers = [finger.name for finger in world.hand.fingers]
    force = np.zeros((2, len(fingers)))
    for contact in world.contacts():
        if contact.other == "cube" and contact.finger in fingers:
            finger = fingers.index(contact.finger)
            force[int(contact.link == world.hand.link_names(finger)[-1]), finger] += contact.force
    return force


def borne(force: NDArray[np.float64]) -> tuple[float, float, float]:
    """Whether enough tips touch, whether another link does, and these links' share of the force, of `normal_forces`."""
    links, tips = force
    total = float(force.sum())
    supported = int((tips > TOUCH_FORCE).sum()) >= SUPPORTING_TIPS
    return float(supported), float((links > TOUCH_FORCE).any()), float(links.sum()) / total if total > 0.0 else 0.0
