"""Links of the DLR-Hand II's fingers: lengths, masses, capsules, and their URDF text."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_cube.hand.hand import CollisionShape

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
