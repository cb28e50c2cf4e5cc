"""What every hand has: fingers around an object, joints with limits, a pose in the world, and drives."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tactile_cube.hand.chain import Chain, PlanarChain
from tactile_cube.hand.urdf import (
    Array,
    CollisionShape,
    collision_element,
    inertial_element,
    origin_element,
    robot_element,
    visual_elements,
)

_COLOURS = {"palm": "0.35 0.37 0.40 1", "link": "0.72 0.74 0.78 1", "tip": "0.13 0.15 0.18 1"}
_BASE = (
    '<link name="base"><inertial><mass value="0.1"/>'
    '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
"""The fixed base of a finger; its numbers do nothing, but Bullet warns about links without any."""


@dataclass(frozen=True)
class Finger:
    """A chain of L revolute joints on the palm, with a sphere at its tip.

    Attributes:
        name: e.g. ring, middle, fore or thumb.
        position: Origin of the first joint's frame in the hand frame (3,) [m].
        rotation: Axes of that frame in the hand frame (3, 3).
        face: Horizontal unit vector from the object's middle towards the finger, in the object's frame (3,): on a cube
            the outward normal of the face it touches.
        joints: Names of its joints, from the palm to the tip (L).
        links: Names of the links that they carry (L); the last one is the tip.
        limits: Of the joints (L, 2) [rad].
        origins: Frame of each further joint in that of the joint before it, as URDF's <origin> (L - 1).
        mass: Of the links (L,) [kg].
        com: Their centres of mass in the frames of their joints (L, 3) [m].
        inertia: Their principal moments about it, along the frames' axes (L, 3) [kg m^2].
        shapes: What can be touched of each link, in its frame.
        chain: Its kinematics.
        prefix: Put before the names of joints and links in the hand's URDF.
    """

    name: str
    position: Array
    rotation: Array
    face: Array
    joints: tuple[str, ...]
    links: tuple[str, ...]
    limits: Array
    origins: tuple[str, ...]
    mass: Array
    com: Array
    inertia: Array
    shapes: tuple[tuple[CollisionShape, ...], ...]
    chain: Chain | PlanarChain
    prefix: str = ""


@dataclass(frozen=True)
class Hand:
    """Fingers that are chains of equally many joints.

    Joint vectors (joints,) are ordered finger by finger, from the palm to the tip. Coupled joints follow an actuated
    one of their finger; arrays of all joints are (fingers, links).

    Attributes:
        name: What it is called in descriptions.
        fingers: The fingers in joint order.
        columns: The actuated joint that each joint of a finger moves with (links,).
        axes: Axis of each link's frame (0, 1, 2 for x, y, z) that its joint turns about (links,).
        tip_radius: Radius of the fingertips' spheres [m].
        action_lower: Limits of the desired joint angles, which an action of -1 means (joints,) [rad].
        action_upper: Limits of the desired joint angles, which an action of +1 means (joints,) [rad].
        position: Hand frame in the world; the object's nominal centre is the origin (3,) [m].
        rotation: Hand frame in the world (3, 3).
        start_angles: Fingers 1 mm off the nominal object (joints,) [rad].
        palm: Shapes of what no joint moves, for pictures.
        palm_contact: Whether they touch the object too; a palm never touches fingers.
        start_fixed: Whether `start_angles` are for every object, not for the nominal one alone.
        drive: Constants of an episode that belong to the drives, by their names in `EpisodeConstants`; what is left out
            is as in the DLR-Hand II.
        file: Name of the URDF's file that it was read from.
        sha256: Of that file.
    """

    name: str
    fingers: tuple[Finger, ...]
    columns: tuple[int, ...]
    axes: tuple[int, ...]
    tip_radius: float
    position: Array
    rotation: Array
    palm: tuple[CollisionShape, ...]
    palm_contact: bool = False
    start_fixed: bool = False
    action_lower: Array = field(default_factory=lambda: np.zeros(0))
    action_upper: Array = field(default_factory=lambda: np.zeros(0))
    start_angles: Array = field(default_factory=lambda: np.zeros(0))
    drive: Mapping[str, float | Array] = field(default_factory=dict)
    file: str = ""
    sha256: str = ""

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the actuated joints, in the order of joint vectors, e.g. `ring_q1`."""
        return tuple(self.chain_joints(k)[link] for k in range(len(self.fingers)) for link in self._own)

    @cached_property
    def lower(self) -> Array:
        """Hardware limits of the joints (joints,) [rad]."""
        return np.concatenate([finger.limits[self._own, 0] for finger in self.fingers])

    @cached_property
    def upper(self) -> Array:
        """Hardware limits of the joints (joints,) [rad]."""
        return np.concatenate([finger.limits[self._own, 1] for finger in self.fingers])

    @property
    def joints_per_finger(self) -> int:
        """Actuated joints of a finger."""
        return len(self._own)

    @property
    def links_per_finger(self) -> int:
        """Links of a finger that move, each with a joint of its own, coupled ones included."""
        return len(self.columns)

    @property
    def joints(self) -> int:
        """Number of actuated joints."""
        return len(self.fingers) * len(self._own)

    @cached_property
    def _own(self) -> list[int]:
        return [self.columns.index(column) for column in range(max(self.columns) + 1)]

    def coupled(self) -> tuple[tuple[int, int], ...]:
        """Return the links of a finger that follow another one of it: (link, leader); both angles are equal."""
        leaders = enumerate(self._own[column] for column in self.columns)
        return tuple((link, leader) for link, leader in leaders if leader != link)

    def chain_joints(self, finger: int) -> tuple[str, ...]:
        """Return the names of all joints of a finger, coupled ones included, as in `urdf`."""
        return tuple(self.fingers[finger].prefix + name for name in self.fingers[finger].joints)

    def followed(self, joint: str) -> str:
        """Return the actuated joint that a joint of `urdf` moves with: itself, or the one that it follows."""
        for k in range(len(self.fingers)):
            names = self.chain_joints(k)
            if joint in names:
                return names[self._own[self.columns[names.index(joint)]]]
        return joint

    def of_finger(self, finger: int) -> slice:
        """Return the slice of a finger's joints in joint vectors."""
        return slice(self.joints_per_finger * finger, self.joints_per_finger * (finger + 1))

    def all_angles(self, actuated: Array | float) -> Array:
        """Return the values of all joints (fingers, links) from those of the actuated ones (joints,)."""
        values = np.broadcast_to(np.asarray(actuated, dtype=np.float64), (self.joints,))
        return values.reshape(len(self.fingers), -1)[:, self.columns]

    def actuated(self, values: Array) -> Array:
        """Return the values of the actuated joints (joints,) from those of all (fingers, links)."""
        return np.asarray(values[:, self._own].ravel())

    def action_of(self, angles: Array) -> Array:
        """Return the action in [-1, 1] for joint angles `(..., joints)` [rad]; angles out of range are clipped."""
        middle = 0.5 * (self.action_lower + self.action_upper)
        half_range = 0.5 * (self.action_upper - self.action_lower)
        return np.clip((angles - middle) / half_range, -1.0, 1.0)

    @cached_property
    def bases(self) -> tuple[Array, Array]:
        """Positions (fingers, 3) [m] and rotations (fingers, 3, 3) of the first joints' frames in the world."""
        positions = [self.position + self.rotation @ base.position for base in self.fingers]
        return np.array(positions), np.array([self.rotation @ base.rotation for base in self.fingers])

    def base_in_world(self, finger: int) -> tuple[Array, Array]:
        """Return the position (3,) [m] and rotation (3, 3) of the first joint's frame in the world."""
        return self.bases[0][finger], self.bases[1][finger]

    def finger_tips(self, finger: int, q: Array) -> Array:
        """Return the centres of a fingertip's sphere in the world (n, 3) [m] at angles (n, joints_per_finger) [rad]."""
        return self.fingers[finger].chain.tips(*self.base_in_world(finger), q)

    def finger_angles(self, finger: int, targets: Array) -> Array:
        """Return angles (n, joints_per_finger) [rad] that bring a fingertip to world points (n, 3) [m], or near them.

        The closed form of the DLR-Hand II takes no account of limits, the search of other hands stays within those of
        actions.
        """
        points, own = np.asarray(targets, dtype=np.float64).reshape(-1, 3), self.of_finger(finger)
        limits = self.action_lower[own], self.action_upper[own]
        return self.fingers[finger].chain.angles(*self.base_in_world(finger), points, *limits)

    def angles_at(self, tips: Array) -> Array:
        """Return joint angles (n, joints) [rad] that bring fingertips to points (n, fingers, 3) [m], or near them."""
        if isinstance(self.fingers[0].chain, PlanarChain):  # one by one: products of a batch round differently
            rows = [[self.finger_angles(k, tip)[0] for k, tip in enumerate(row)] for row in tips]
            return np.array(rows).reshape(len(tips), -1)
        return np.concatenate([self.finger_angles(k, tips[:, k]) for k in range(len(self.fingers))], axis=1)

    def urdf(self) -> str:
        """Return the URDF of the whole hand: root link `palm`, joints `joint_names` and the coupled ones."""
        colour = f'<material name="palm"><color rgba="{_COLOURS["palm"]}"/></material>'
        parts = [f'<link name="palm">{"".join(visual_elements(shape, colour) for shape in self.palm)}</link>']
        for finger in self.fingers:
            base = origin_element(finger.position, finger.rotation)
            parts += self._finger_parts(finger, finger.prefix, "palm", base)
        return robot_element(self.name, parts)

    def palm_urdf(self) -> str:
        """Return the URDF of what no joint moves, rooted in the hand frame, with the shapes that the object touches."""
        shapes = "".join(collision_element(shape) for shape in self.palm)
        return robot_element("palm", [_BASE.replace("</link>", shapes + "</link>")])

    def finger_urdf(self, finger: int) -> str:
        """Return a finger's own URDF, rooted in the frame of its first joint; names are without its prefix."""
        return robot_element("finger", [_BASE, *self._finger_parts(self.fingers[finger], "", "base", "")])

    @property
    def urdf_name(self) -> str:
        """Name of its URDF's file."""
        return self.file or f"{self.name}.urdf"

    @property
    def urdf_sha256(self) -> str:
        """SHA-256 of that file, or of the text of `urdf` where there is none."""
        return self.sha256 or hashlib.sha256(self.urdf().encode()).hexdigest()

    def _finger_parts(self, finger: Finger, prefix: str, parent: str, base: str) -> list[str]:
        links, joints = [], []
        for k, (link, joint) in enumerate(zip(finger.links, finger.joints, strict=True)):
            name = prefix + link
            colour = _COLOURS["tip" if link == finger.links[-1] else "link"]
            material = f'<material name="{name}"><color rgba="{colour}"/></material>'
            drawn = "".join(collision_element(shape) + visual_elements(shape, material) for shape in finger.shapes[k])
            weight = inertial_element(finger.mass[k], finger.com[k], np.diag(finger.inertia[k]))
            links.append(f'<link name="{name}">{weight}{drawn}</link>')
            leader = self._own[self.columns[k]]
            mimic = "" if leader == k else f'<mimic joint="{prefix}{finger.joints[leader]}" multiplier="1" offset="0"/>'
            axis = ("1 0 0", "0 1 0", "0 0 1")[self.axes[k]]
            place = f'<parent link="{parent}"/><child link="{name}"/>{(base, *finger.origins)[k]}<axis xyz="{axis}"/>'
            lower, upper = finger.limits[k]
            limit = f'<limit lower="{lower:.10g}" upper="{upper:.10g}" effort="10" velocity="50"/>'
            joints.append(f'<joint name="{prefix}{joint}" type="revolute">{place}{limit}{mimic}</joint>')
            parent = name
        return links + joints
