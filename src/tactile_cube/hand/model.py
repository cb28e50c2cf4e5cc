"""Hands like the DLR-Hand II: identical fingers of three actuated joints, the last of which moves two links."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_cube.hand import closed_form, urdf
from tactile_cube.hand.hand import Array, FingerBase, Hand
from tactile_cube.hand.shape import Shape

__all__ = ["Array", "Capsule", "FingerBase", "HandModel", "Link"]

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

    def shape(self) -> Shape:
        """The same for an engine."""
        middle = np.array([0.0, 0.0, 0.5 * (self.start + self.end)])
        return Shape("capsule", (self.radius, self.end - self.start), middle)


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
class HandModel(Hand):
    """A hand of identical fingers with three actuated joints each; q4 follows q3.

    Attributes:
        links: Knuckle, proximal, middle and distal link, the same for all fingers.
        coupled_upper: Hardware limit of q4 [rad].
    """

    links: tuple[Link, ...]
    coupled_upper: float

    @property
    def name(self) -> str:
        """See `Hand`."""
        return "dlr_hand2"

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the actuated joints, e.g. `ring_q1`."""
        return tuple(f"{finger.name}_q{j}" for finger in self.fingers for j in range(1, JOINTS_PER_FINGER + 1))

    @property
    def joints_per_finger(self) -> int:
        """See `Hand`."""
        return JOINTS_PER_FINGER

    @property
    def links_per_finger(self) -> int:
        """See `Hand`."""
        return LINKS_PER_FINGER

    def coupled(self) -> tuple[tuple[int, int], ...]:
        """See `Hand`."""
        return ((3, 2),)

    def link_names(self, finger: int) -> tuple[str, ...]:
        """See `Hand`."""
        return LINK_NAMES

    def shapes(self, finger: int) -> tuple[tuple[Shape, ...], ...]:
        """See `Hand`."""
        return tuple(() if link.capsule is None else (link.capsule.shape(),) for link in self.links)

    def link_limits(self, finger: int) -> Array:
        """See `Hand`."""
        own = self.of_finger(finger)
        lower, upper = self.lower[own], self.upper[own]
        return np.stack([[*lower, lower[-1]], [*upper, self.coupled_upper]], axis=1)

    def spin_axes(self) -> tuple[int, ...]:
        """See `Hand`."""
        return (2, 1, 1, 1)

    def finger_urdf(self, finger: int) -> str:
        """See `Hand`; all fingers are identical."""
        return urdf.finger_urdf(self)

    def urdf(self) -> str:
        """See `Hand`."""
        return urdf.hand_urdf(self)

    def chain_joints(self, finger: int) -> tuple[str, ...]:
        """See `Hand`."""
        return tuple(f"{self.fingers[finger].name}_q{k + 1}" for k in range(LINKS_PER_FINGER))

    def followed(self, joint: str) -> str:
        """See `Hand`."""
        return joint.removesuffix("_q4") + "_q3" if joint.endswith("_q4") else joint

    def finger_tips(self, finger: int, q: Array) -> Array:
        """See `Hand`."""
        return closed_form.finger_tips(self, finger, q)

    def finger_angles(self, finger: int, targets: Array) -> Array:
        """See `Hand`; joint limits are not applied."""
        return closed_form.finger_angles(self, finger, targets)

    def angles_at(self, tips: Array) -> Array:
        """See `Hand`."""
        rows = [[closed_form.finger_angles(self, k, tip[None])[0] for k, tip in enumerate(row)] for row in tips]
        return np.array(rows).reshape(len(tips), -1)

    @property
    def tip_radius(self) -> float:
        """Radius of the fingertip's sphere [m]."""
        return self._tip.radius

    @property
    def tip_reach(self) -> tuple[float, float, float]:
        """Distances q2-q3, q3-q4 and q4-centre of the fingertip's sphere [m]."""
        return self.links[1].length, self.links[2].length, self._tip.end

    @property
    def _tip(self) -> Capsule:
        capsule = self.links[-1].capsule
        assert capsule is not None, "the distal link is what touches"
        return capsule
