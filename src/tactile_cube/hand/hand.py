"""What every hand has: fingers around an object, joints with limits, a pose in the world, and drives."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CollisionShape:
    """A convex shape in a link's frame, in plain numbers that every engine can build.

    Attributes:
        kind: what it is.
        size: of a box its edges (3,), of a cylinder or capsule radius and length of the straight part (2,), of a sphere
            its radius (1,), of a mesh its scale (3,).
        position: of its middle (3,) [m].
        rotation: of its axes (3, 3); cylinders and capsules lie along z.
        file: of a mesh.
    """

    kind: Literal["box", "cylinder", "capsule", "sphere", "mesh"]
    size: tuple[float, ...]
    position: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))
    file: str = ""


@dataclass(frozen=True)
class FingerBase:
    """Where a finger sits on the palm, and where it touches the object.

    Attributes:
        name: e.g. ring, middle, fore or thumb.
        position: Origin of the first joint's frame in the hand frame (3,) [m].
        rotation: Axes of that frame in the hand frame (3, 3).
        face: Horizontal unit vector from the object's middle towards the finger, in the object's frame (3,): on a cube
            the outward normal of the face it touches.
    """

    name: str
    position: Array
    rotation: Array
    face: Array


@dataclass(frozen=True)
class Hand(ABC):
    """Fingers that are chains of equally many joints, each with a sphere at its tip.

    Joint vectors (joints,) are ordered finger by finger, from the palm to the tip. Coupled joints follow an actuated
    one of their finger; arrays of all joints are (fingers, links).

    Attributes:
        fingers: The fingers in joint order.
        lower: Hardware limits of the joints (joints,) [rad].
        upper: Hardware limits of the joints (joints,) [rad].
        action_lower: Limits of the desired joint angles, which an action of -1 means (joints,) [rad].
        action_upper: Limits of the desired joint angles, which an action of +1 means (joints,) [rad].
        position: Hand frame in the world; the object's nominal centre is the origin (3,) [m].
        rotation: Hand frame in the world (3, 3).
        start_angles: Fingers 1 mm off the nominal object (joints,) [rad].
        drive: Constants of an episode that belong to the drives, by their names in `EpisodeConstants`; what is left out
            is as in the DLR-Hand II.
    """

    fingers: tuple[FingerBase, ...]
    lower: Array
    upper: Array
    action_lower: Array
    action_upper: Array
    position: Array
    rotation: Array
    start_angles: Array
    drive: Mapping[str, float | Array] = field(default_factory=dict, kw_only=True)

    @property
    @abstractmethod
    def name(self) -> str:
        """What it is called in descriptions."""

    @property
    @abstractmethod
    def joint_names(self) -> tuple[str, ...]:
        """Names of the actuated joints, in the order of joint vectors."""

    @property
    @abstractmethod
    def joints_per_finger(self) -> int:
        """Actuated joints of a finger."""

    @property
    @abstractmethod
    def links_per_finger(self) -> int:
        """Links of a finger that move, each with a joint of its own, coupled ones included; the last one is the tip."""

    @property
    @abstractmethod
    def tip_radius(self) -> float:
        """Radius of the fingertip's sphere [m]."""

    @abstractmethod
    def coupled(self) -> tuple[tuple[int, int], ...]:
        """Links of a finger that follow another one of it: (link, leader); both angles are equal."""

    @abstractmethod
    def link_names(self, finger: int) -> tuple[str, ...]:
        """Names of a finger's links, from the palm to the tip."""

    @abstractmethod
    def shapes(self, finger: int) -> tuple[tuple[CollisionShape, ...], ...]:
        """What can be touched of each link of a finger, in the link's frame."""

    @abstractmethod
    def link_limits(self, finger: int) -> Array:
        """Hardware limits of all joints of a finger (links, 2) [rad]."""

    @abstractmethod
    def spin_axes(self) -> tuple[int, ...]:
        """Principal axis of each link (0, 1, 2 for x, y, z) that lies along its joint's axis."""

    @abstractmethod
    def finger_urdf(self, finger: int) -> str:
        """A finger as a robot of its own, rooted in its base; its links are `link_names`, parents first."""

    @abstractmethod
    def urdf(self) -> str:
        """The whole hand; its root link is `palm`, its joints are `joint_names` and the coupled ones."""

    @property
    def urdf_name(self) -> str:
        """Name of its URDF's file."""
        return f"{self.name}.urdf"

    @property
    def urdf_sha256(self) -> str:
        """SHA-256 of that file, or of the text of `urdf` where there is none."""
        return hashlib.sha256(self.urdf().encode()).hexdigest()

    @abstractmethod
    def followed(self, joint: str) -> str:
        """The actuated joint that a joint of `urdf` moves with: itself, or the one that it follows."""

    @abstractmethod
    def finger_tips(self, finger: int, q: Array) -> Array:
        """Centres of a fingertip's sphere in the world (n, 3) [m] for its joint angles (n, joints_per_finger) [rad]."""

    @abstractmethod
    def finger_angles(self, finger: int, targets: Array) -> Array:
        """Angles (n, joints_per_finger) [rad] that bring a fingertip to world points (n, 3) [m], or near them."""

    @abstractmethod
    def angles_at(self, tips: Array) -> Array:
        """Joint angles (n, joints) [rad] that bring all fingertips to points (n, fingers, 3) [m], or near them."""

    @property
    def joints(self) -> int:
        """Number of actuated joints."""
        return len(self.fingers) * self.joints_per_finger

    @abstractmethod
    def chain_joints(self, finger: int) -> tuple[str, ...]:
        """Names of all joints of a finger, coupled ones included, as in `urdf`."""

    def of_finger(self, finger: int) -> slice:
        """Where a finger's joints stand in joint vectors."""
        return slice(self.joints_per_finger * finger, self.joints_per_finger * (finger + 1))

    def all_angles(self, actuated: Array | float) -> Array:
        """Values of all joints (fingers, links) from those of the actuated ones (joints,)."""
        values = np.broadcast_to(np.asarray(actuated, dtype=np.float64), (self.joints,))
        leaders = {link: leader for link, leader in self.coupled()}
        own = [link for link in range(self.links_per_finger) if link not in leaders]
        column = [own.index(leaders.get(link, link)) for link in range(self.links_per_finger)]
        return values.reshape(len(self.fingers), -1)[:, column]

    def actuated(self, values: Array) -> Array:
        """Values of the actuated joints (joints,) from those of all (fingers, links)."""
        followers = {link for link, _ in self.coupled()}
        own = [link for link in range(self.links_per_finger) if link not in followers]
        return np.asarray(values[:, own].ravel())

    def action_of(self, angles: Array) -> Array:
        """Action in [-1, 1] that asks for joint angles `(..., joints)` [rad]; angles out of range are clipped."""
        middle = 0.5 * (self.action_lower + self.action_upper)
        half_range = 0.5 * (self.action_upper - self.action_lower)
        return np.clip((angles - middle) / half_range, -1.0, 1.0)

    def base_in_world(self, finger: int) -> tuple[Array, Array]:
        """Position (3,) [m] and rotation (3, 3) of the first joint's frame in the world."""
        base = self.fingers[finger]
        return self.position + self.rotation @ base.position, self.rotation @ base.rotation
