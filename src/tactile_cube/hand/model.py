"""What a hand is: fingers on a palm, the geometry and mass of their links, joint limits, pose in the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

JOINTS_PER_FINGER = 3
LINKS_PER_FINGER = 4
LINK_NAMES = ("knuckle", "proximal", "middle", "distal")


@dataclass(frozen=True)
class Capsule:
    """Collision shape of a link: a capsule along the link's z axis.

    Attributes:
        radius: [m].
        start: Centre of the first half sphere along z [m].
        end: Centre of the second half sphere along z [m].
    """

    radius: float
    start: float
    end: float


@dataclass(frozen=True)
class Link:
    """One link of a finger; z points along the link, y is the axis of the joint that moves it.

    Attributes:
        name: One of `LINK_NAMES`.
        length: Distance to the next joint axis [m].
        mass: [kg].
        centre_of_mass: Along z [m].
        capsule: Collision shape, or None where nothing can be touched.
    """

    name: str
    length: float
    mass: float
    centre_of_mass: float
    capsule: Capsule | None

    def inertia(self) -> tuple[float, float, float]:
        """Moments about the centre of mass, of a solid cylinder in the capsule's place (x, y, z) [kg m^2]."""
        radius, length = (0.012, 0.02) if self.capsule is None else (self.capsule.radius, self.length)
        across = self.mass * (3.0 * radius**2 + length**2) / 12.0
        return across, across, 0.5 * self.mass * radius**2


@dataclass(frozen=True)
class FingerBase:
    """Where a finger sits on the palm.

    Attributes:
        name: ring, middle, fore or thumb.
        position: Origin of q1's frame in the hand frame (3,) [m].
        rotation: Axes of q1's frame in the hand frame (3, 3).
        face: Outward normal of the cube face this finger touches, in the cube's frame (3,).
    """

    name: str
    position: Array
    rotation: Array
    face: Array


@dataclass(frozen=True)
class HandModel:
    """A hand of identical fingers with three actuated joints each; q4 follows q3.

    Joint vectors are ordered finger by finger, (q1, q2, q3) within a finger.

    Attributes:
        fingers: The fingers in joint order.
        links: Knuckle, proximal, middle and distal link, the same for all fingers.
        lower: Hardware limits of the joints (12,) [rad].
        upper: Hardware limits of the joints (12,) [rad].
        action_lower: Limits of the desired joint angles, which an action of -1 means (12,) [rad].
        action_upper: Limits of the desired joint angles, which an action of +1 means (12,) [rad].
        position: Hand frame in the world; the cube's nominal centre is the origin (3,) [m].
        rotation: Hand frame in the world (3, 3).
        start_angles: Fingers 1 mm off the faces of the nominal cube (12,) [rad].
        coupled_upper: Hardware limit of q4 [rad].
    """

    fingers: tuple[FingerBase, ...]
    links: tuple[Link, ...]
    lower: Array
    upper: Array
    action_lower: Array
    action_upper: Array
    position: Array
    rotation: Array
    start_angles: Array
    coupled_upper: float

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the actuated joints, e.g. `ring_q1`."""
        return tuple(f"{finger.name}_q{j}" for finger in self.fingers for j in range(1, JOINTS_PER_FINGER + 1))

    def action_of(self, angles: Array) -> Array:
        """Action in [-1, 1] that asks for joint angles `(..., 12)` [rad]; angles out of range are clipped."""
        middle = 0.5 * (self.action_lower + self.action_upper)
        half_range = 0.5 * (self.action_upper - self.action_lower)
        return np.clip((angles - middle) / half_range, -1.0, 1.0)

    @property
    def tip_radius(self) -> float:
        """Radius of the fingertip's sphere [m]."""
        return self._tip.radius

    @property
    def tip_reach(self) -> tuple[float, float, float]:
        """Distances q2-q3, q3-q4 and q4-centre of the fingertip's sphere [m]."""
        return self.links[1].length, self.links[2].length, self._tip.end

    def base_in_world(self, finger: int) -> tuple[Array, Array]:
        """Position (3,) [m] and rotation (3, 3) of q1's frame in the world."""
        base = self.fingers[finger]
        return self.position + self.rotation @ base.position, self.rotation @ base.rotation

    @property
    def _tip(self) -> Capsule:
        capsule = self.links[-1].capsule
        assert capsule is not None, "the distal link is what touches"
        return capsule
