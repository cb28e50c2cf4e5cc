"""Elements of a URDF as values: joints, the bodies that they carry, placements, numbers."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.hand.urdf import Array

MOVABLE = ("revolute", "continuous", "prismatic")
FREE = ("floating", "planar")  # types of joints without a drive; their links are held where the URDF puts them
ROUNDING = 0.02  # share of the largest principal moment that rounded numbers may lack to those of a body
NO_INERTIA = 1e-15  # [kg m^2] A moment that is rounding of zero: a milligram of 1 mm has 1e-13


@dataclass(frozen=True)
class Mimic:
    """A joint that follows another one: position = ratio * position of `joint` + offset [rad or m]."""

    joint: str
    ratio: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Placement:
    """A frame in another one: rotation (3, 3), translation (3,) [m]."""

    rotation: Array = field(default_factory=lambda: np.eye(3))
    translation: Array = field(default_factory=lambda: np.zeros(3))

    def then(self, inner: Placement) -> Placement:
        """Return `inner`, a frame given in this frame, as seen from outside this frame."""
        return Placement(self.rotation @ inner.rotation, self.rotation @ inner.translation + self.translation)


@dataclass(frozen=True)
class Body:
    """Mass [kg], centre of mass (3,) [m] and inertia (3, 3) about it [kg m^2], in one frame."""

    mass: float = 0.0
    com: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))

    def seen_from(self, place: Placement) -> Body:
        """Return the same body in the frame in which its own frame is at `place`."""
        R = place.rotation
        return Body(self.mass, R @ self.com + place.translation, R @ self.inertia @ R.T)

    def joined(self, other: Body) -> Body:
        """Return both bodies as one (parallel-axis theorem)."""
        mass = self.mass + other.mass
        if mass == 0.0:
            return Body(0.0, self.com, self.inertia + other.inertia)
        com = (self.mass * self.com + other.mass * other.com) / mass
        arms = ((b, b.com - com) for b in (self, other))
        moved = (b.inertia + b.mass * (r @ r * np.eye(3) - np.outer(r, r)) for b, r in arms)
        return Body(mass, com, sum(moved, np.zeros((3, 3))))


@dataclass(frozen=True)
class Joint:
    """A joint of the URDF with the link it carries; `parent` and `link` are link names.

    `velocity` [rad/s] and `effort` [N m] are its limits, inf where none is stated.
    """

    name: str
    kind: str
    parent: str
    link: str
    placement: Placement
    axis: Array
    lower: float
    upper: float
    velocity: float
    effort: float
    coupling: Mimic | None
    body: Body

    @property
    def prismatic(self) -> bool:
        """Whether it slides."""
        return self.kind == "prismatic"

    @property
    def movable(self) -> bool:
        """Whether a drive can move it."""
        return self.kind in MOVABLE

    @property
    def free(self) -> bool:
        """Whether it moves without a drive."""
        return self.kind in FREE


def joint_of(element: ElementTree.Element, bodies: Mapping[str, Body]) -> Joint:
    """Read a <joint>, with the body of the link that it carries from `bodies` by link."""
    name = attribute(element, "name", "a joint")
    kind = attribute(element, "type", f"joint '{name}'")
    if kind not in (*MOVABLE, *FREE, "fixed"):
        raise InputError(f"URDF: joint '{name}' has type '{kind}'; use one of {', '.join(MOVABLE)} or fixed")
    parent, child = (_linked(element, end, name, bodies) for end in ("parent", "child"))
    limit, mimic, coupling = element.find("limit"), element.find("mimic"), None
    if mimic is not None and kind in MOVABLE:
        where = f"the <mimic> of joint '{name}'"
        ratio, offset = number(mimic, "multiplier", where, 1.0), number(mimic, "offset", where, 0.0)
        coupling = Mimic(attribute(mimic, "joint", where), ratio, offset)
    bounded = kind != "continuous" and limit is not None and not {"lower", "upper"}.isdisjoint(limit.keys())
    return Joint(
        name=name,
        kind=kind,
        parent=parent,
        link=child,
        placement=placement_of(element, f"joint '{name}'"),
        axis=_axis(element, name) if kind in MOVABLE else np.array([1.0, 0.0, 0.0]),
        lower=_end(limit, "lower", name) if bounded else -np.inf,
        upper=_end(limit, "upper", name) if bounded else np.inf,
        velocity=_strength(limit, "velocity", name),
        effort=_strength(limit, "effort", name),
        coupling=coupling,
        body=bodies[child],
    )


def _end(limit: ElementTree.Element | None, key: str, joint: str) -> float:
    """Read a limit; exporters write 1e16 or inf where they know none."""
    value = number(limit, key, f"the limit of joint '{joint}'", 0.0, most=np.inf)
    return value if abs(value) <= limits.NUMBER else float(np.copysign(np.inf, value))


def _strength(limit: ElementTree.Element | None, key: str, joint: str) -> float:
    """Read a limit of speed or torque; exporters also write 0 or -1 where they know none."""
    value = _end(limit, key, joint)
    return value if value > 0.0 else float("inf")


def body_of(link: ElementTree.Element) -> Body:
    """Read the <inertial> of a <link>; without one it has no mass. Raises InputError: no body has this mass."""
    inertial, where = link.find("inertial"), f"link '{link.get('name')}'"
    if inertial is None:
        return Body()
    mass = number(inertial.find("mass"), "value", f"the mass of {where}", 0.0)
    element = inertial.find("inertia")
    xx, yy, zz, xy, xz, yz = (
        number(element, key, f"the inertia of {where}", 0.0) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    body = Body(mass, np.zeros(3), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if not 0.0 <= mass <= limits.MASS:
        raise InputError(f"URDF: {where} has mass {mass:g} kg; give it 0 to {limits.MASS:g} kg")
    return body.seen_from(placement_of(inertial, where))


def balanced(body: Body, link: str) -> Body:
    """Return the body, with its mean moment where its moments are impossible, as MuJoCo's balanceinertia does.

    Raises:
        InputError: the mean is no moment of inertia either.
    """
    moments = principal_moments(body)
    least, middle, most = moments
    if min(least, least + middle - most) >= -max(ROUNDING * abs(most), NO_INERTIA):
        return body
    if moments.mean() <= 0.0:
        numbers = ", ".join(f"{one:.4g}" for one in moments)
        raise InputError(
            f"URDF: link '{link}' has principal moments of inertia {numbers} kg m^2; give it those of a body: none "
            "negative, none larger than the other two together"
        )
    return replace(body, inertia=moments.mean() * np.eye(3))


def principal_moments(body: Body) -> Array:
    """Return the moments (3,) about its centre of mass, the smallest first [kg m^2]."""
    return np.asarray(np.linalg.eigvalsh(body.inertia))


def placement_of(element: ElementTree.Element, where: str) -> Placement:
    """Read the <origin> of an element."""
    origin = element.find("origin")
    if origin is None:
        return Placement()
    roll, pitch, yaw = triple(origin, "rpy", where)
    return Placement(_about(2, yaw) @ _about(1, pitch) @ _about(0, roll), triple(origin, "xyz", where))


def _about(axis: int, angle: float) -> Array:
    """Return the rotation matrix about a coordinate axis; quarter turns are exact to rounding."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = np.cos(angle)
    R[j, i] = np.sin(angle)
    R[i, j] = -R[j, i]
    return R


def _axis(element: ElementTree.Element, name: str) -> Array:
    axis = element.find("axis")
    if axis is None:
        return np.array([1.0, 0.0, 0.0])  # URDF's default
    vector = triple(axis, "xyz", f"the axis of joint '{name}'")
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        raise InputError(f"URDF: the axis of joint '{name}' is zero; give it a direction")
    return vector / length


def triple(element: ElementTree.Element, key: str, where: str) -> Array:
    """Return the three numbers of an attribute (3,)."""
    text = element.get(key, "0 0 0")
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.zeros(0)
    if values.shape != (3,) or not np.all(np.abs(values) <= limits.NUMBER):
        raise InputError(f'URDF: {where} has {key}="{text}"; it takes three numbers up to {limits.NUMBER:g}')
    return values


def number(
    element: ElementTree.Element | None, key: str, where: str, default: float, most: float = limits.NUMBER
) -> float:
    """Read one number of an attribute, of size `most` or less."""
    text = element.get(key) if element is not None else None
    try:
        value = default if text is None else float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) <= most:
        raise InputError(f'URDF: {where} has {key}="{text}"; it takes a number up to {limits.NUMBER:g}')
    return value


def attribute(element: ElementTree.Element, key: str, where: str) -> str:
    """Read an attribute that must be there."""
    value = element.get(key)
    if not value:
        raise InputError(f"URDF: {where} lacks the attribute '{key}'; add it")
    return value


def _linked(element: ElementTree.Element, end: str, name: str, bodies: Mapping[str, Body]) -> str:
    found = element.find(end)
    link = found.get("link", "") if found is not None else ""
    if link not in bodies:
        raise InputError(f"URDF: the {end} link '{link}' of joint '{name}' is not defined; add <link name=.../>")
    return link
