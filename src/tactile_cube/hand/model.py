"""Hands like the DLR-Hand II: identical fingers of three actuated joints, the last of which moves two links.

In their URDF a finger's root link is the frame of q1, which turns about its z axis. Every further link's z axis points
along the link and its joint turns about y.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_cube.hand.chain import planar_angles, planar_tips
from tactile_cube.hand.hand import Array, CollisionShape, Hand
from tactile_cube.hand.urdf import ROBOT_ROOT, number_list, origin_element, robot_element

COLOURS = {"palm": "0.35 0.37 0.40 1", "link": "0.72 0.74 0.78 1", "tip": "0.13 0.15 0.18 1"}


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

    def shape(self) -> CollisionShape:
        """The same for an engine."""
        middle = np.array([0.0, 0.0, 0.5 * (self.start + self.end)])
        return CollisionShape("capsule", (self.radius, self.end - self.start), middle)


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


def link_urdf(prefix: str, link: Link) -> str:
    """A link as URDF's <link>, its name after `prefix`: mass, inertia, capsule."""
    ixx, iyy, izz = link.inertia()
    inertia = f'<inertia ixx="{ixx:.10g}" iyy="{iyy:.10g}" izz="{izz:.10g}" ixy="0" ixz="0" iyz="0"/>'
    inertial = f'<inertial><origin xyz="0 0 {link.centre_of_mass}"/><mass value="{link.mass}"/>{inertia}</inertial>'
    colour = COLOURS["tip" if link.name == "distal" else "link"]
    name = prefix + link.name
    shapes = "" if link.capsule is None else _collision(link.capsule) + _visual(name, link.capsule, colour)
    return f'<link name="{name}">{inertial}{shapes}</link>'


def _collision(capsule: Capsule) -> str:
    length = capsule.end - capsule.start
    geometry = f'<geometry><capsule radius="{capsule.radius}" length="{length:.10g}"/></geometry>'
    return f"<collision>{_at(0.5 * (capsule.start + capsule.end))}{geometry}</collision>"


def _visual(name: str, capsule: Capsule, colour: str) -> str:
    """The same capsule as a cylinder and two spheres, which every URDF reader can draw."""
    material = f'<material name="{name}"><color rgba="{colour}"/></material>'
    cylinder = f'<geometry><cylinder radius="{capsule.radius}" length="{capsule.end - capsule.start:.10g}"/></geometry>'
    middle = 0.5 * (capsule.start + capsule.end)
    body = f"<visual>{_at(middle)}{cylinder}{material}</visual>"
    sphere = f'<geometry><sphere radius="{capsule.radius}"/></geometry>{material}'
    ends = "".join(f"<visual>{_at(end)}{sphere}</visual>" for end in (capsule.start, capsule.end))
    return body + ends


def _at(along: float) -> str:
    return f'<origin xyz="0 0 {along:.10g}"/>'


JOINTS_PER_FINGER = 3
LINKS_PER_FINGER = 4
_AXIS_Y, _AXIS_Z = '<axis xyz="0 1 0"/>', '<axis xyz="0 0 1"/>'
_ACROSS = f'<origin xyz="0 0 0" rpy="{np.pi} {-np.pi / 2.0} 0"/>'
"""From q1's frame to q2's: z along the finger, which is x of the base, y against y of the base."""
LINK_NAMES = ("knuckle", "proximal", "middle", "distal")


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

    def shapes(self, finger: int) -> tuple[tuple[CollisionShape, ...], ...]:
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
        return finger_urdf(self)

    def urdf(self) -> str:
        """See `Hand`."""
        return hand_urdf(self)

    def chain_joints(self, finger: int) -> tuple[str, ...]:
        """See `Hand`."""
        return tuple(f"{self.fingers[finger].name}_q{k + 1}" for k in range(LINKS_PER_FINGER))

    def followed(self, joint: str) -> str:
        """See `Hand`."""
        return joint.removesuffix("_q4") + "_q3" if joint.endswith("_q4") else joint

    def finger_tips(self, finger: int, q: Array) -> Array:
        """See `Hand`."""
        origin, rotation = self.base_in_world(finger)
        return np.asarray(origin + planar_tips(self.tip_reach, q) @ rotation.T)

    def finger_angles(self, finger: int, targets: Array) -> Array:
        """See `Hand`; joint limits are not applied."""
        origin, rotation = self.base_in_world(finger)
        points = np.asarray(targets, dtype=np.float64).reshape(-1, 3)
        return planar_angles(self.tip_reach, (points - origin) @ rotation)

    def angles_at(self, tips: Array) -> Array:
        """See `Hand`."""
        rows = [[self.finger_angles(k, tip)[0] for k, tip in enumerate(row)] for row in tips]
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


def finger_urdf(hand: HandModel, prefix: str = "") -> str:
    """One finger as a robot of its own, rooted in the frame of q1: joints q1, q2, q3 and q4 which mimics q3.

    Args:
        hand: The hand; all its fingers are identical, so no finger is named.
        prefix: Put before link and joint names, e.g. `ring_`.
    """
    root = f"{prefix}base"
    return robot_element(f"{prefix}finger", [ROBOT_ROOT.format(name=root), *_finger_parts(hand, prefix, root, "")])


def hand_urdf(hand: HandModel) -> str:
    """The whole hand: `palm` and four fingers, joints `ring_q1` .. `thumb_q4`; the same links as `finger_urdf`."""
    parts = [_palm(hand)]
    for finger in hand.fingers:
        parts += _finger_parts(hand, f"{finger.name}_", "palm", origin_element(finger.position, finger.rotation))
    return robot_element("dlr_hand2", parts)


def _finger_parts(hand: HandModel, prefix: str, parent: str, base: str) -> list[str]:
    """Links and joints of a finger whose q1 frame sits at `base` (an origin element) in `parent`."""
    knuckle, proximal, middle, distal = hand.links
    lower, upper = hand.lower[:3], hand.upper[:3]
    mimic = f'<mimic joint="{prefix}q3" multiplier="1" offset="0"/>'
    name = [prefix + link.name for link in hand.links]
    along = [origin_element(np.array([0.0, 0.0, link.length])) for link in (proximal, middle)]
    return [
        *(link_urdf(prefix, link) for link in (knuckle, proximal, middle, distal)),
        _joint(f"{prefix}q1", parent, name[0], base, _AXIS_Z, lower[0], upper[0]),
        _joint(f"{prefix}q2", name[0], name[1], _ACROSS, _AXIS_Y, lower[1], upper[1]),
        _joint(f"{prefix}q3", name[1], name[2], along[0], _AXIS_Y, lower[2], upper[2]),
        _joint(f"{prefix}q4", name[2], name[3], along[1], _AXIS_Y, lower[2], hand.coupled_upper, mimic),
    ]


def _joint(
    name: str, parent: str, child: str, origin: str, axis: str, lower: float, upper: float, extra: str = ""
) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    limit = f'<limit lower="{lower:.10g}" upper="{upper:.10g}" effort="10" velocity="50"/>'
    return f'<joint name="{name}" type="revolute">{ends}{origin}{axis}{limit}{extra}</joint>'


def _palm(hand: HandModel) -> str:
    """The palm as a slab under the finger bases, for pictures only: nothing ever reaches it."""
    bases = np.array([finger.position for finger in hand.fingers])
    low, high = bases.min(axis=0), bases.max(axis=0)
    size = np.array([high[0] - low[0], high[1] - low[1] + 0.03, 0.10])
    centre = np.array([*(0.5 * (low + high))[:2], low[2] - 0.05])
    geometry = f'<geometry><box size="{number_list(size)}"/></geometry>'
    material = f'<material name="palm"><color rgba="{COLOURS["palm"]}"/></material>'
    return f'<link name="palm"><visual>{origin_element(centre)}{geometry}{material}</visual></link>'
