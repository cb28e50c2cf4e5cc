"""Write URDF text: elements that every mechanism has, shapes, and changed masses of links."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError

Array = NDArray[np.float64]

_UPRIGHT = 1e-9


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


def with_inertias(urdf: str, links: Sequence[str], mass: Array, com: Array, inertia: Array) -> str:
    """Return the same robot with other masses (n,) [kg] of some links.

    Centres of mass (n, 3) [m] and inertias about them (n, 3, 3) [kg m^2] are in the links' frames.
    """
    robot = ElementTree.fromstring(urdf)
    for k, name in enumerate(links):
        link = robot.find(f"link[@name='{name}']")
        old = link.find("inertial") if link is not None else None
        if link is None or old is None:
            raise InputError(f"URDF: no link '{name}' with an inertial element")
        link.remove(old)
        link.append(ElementTree.fromstring(inertial_element(mass[k], com[k], inertia[k], digits=12)))
    return ElementTree.tostring(robot, encoding="unicode")


def robot_element(name: str, parts: Iterable[str]) -> str:
    """Return a whole robot description from its links and joints."""
    return "\n".join(['<?xml version="1.0"?>', f'<robot name="{name}">', *parts, "</robot>", ""])


def inertial_element(mass: float, com: Array, inertia: Array, digits: int = 10) -> str:
    """Return the mass [kg], centre of mass (3,) [m] and inertia (3, 3) about it [kg m^2] as URDF's <inertial>."""
    upper = zip(["xx", "xy", "xz", "yy", "yz", "zz"], inertia[np.triu_indices(3)], strict=True)
    moments = " ".join(f'i{axes}="{value:.{digits}g}"' for axes, value in upper)
    place = f'<origin xyz="{number_list(com)}"/>'
    return f'<inertial>{place}<mass value="{mass:.{digits}g}"/><inertia {moments}/></inertial>'


def origin_element(position: Array, rotation: Array | None = None) -> str:
    """Return a position (3,) [m] and rotation (3, 3) as URDF's <origin>."""
    rpy = np.zeros(3) if rotation is None else roll_pitch_yaw(rotation)
    return f'<origin xyz="{number_list(position)}" rpy="{number_list(rpy)}"/>'


def roll_pitch_yaw(rotation: Array) -> Array:
    """Return the URDF's angles (3,) [rad] of a rotation matrix (3, 3): about fixed x, then y, then z."""
    level = np.hypot(rotation[0, 0], rotation[1, 0])
    pitch = np.arctan2(-rotation[2, 0], level)
    if level < _UPRIGHT:  # roll and yaw turn about the same axis: leave it all to roll
        return np.array([np.arctan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0])
    roll = np.arctan2(rotation[2, 1], rotation[2, 2])
    return np.array([roll, pitch, np.arctan2(rotation[1, 0], rotation[0, 0])])


def number_list(values: Array) -> str:
    """Return numbers as text with spaces between them."""
    return " ".join(f"{value:.12g}" for value in values)


def collision_element(shape: CollisionShape) -> str:
    """Return a shape as URDF's <collision>."""
    return f"<collision>{origin_element(shape.position, shape.rotation)}{_geometry(shape)}</collision>"


def visual_elements(shape: CollisionShape, material: str) -> str:
    """Return a shape as <visual> elements that every reader can draw: a capsule as a cylinder and two spheres."""
    if shape.kind != "capsule":
        return f"<visual>{origin_element(shape.position, shape.rotation)}{_geometry(shape)}{material}</visual>"
    radius, length = shape.size
    along = 0.5 * length * shape.rotation[:, 2]
    parts = [
        CollisionShape("cylinder", (radius, length), shape.position, shape.rotation),
        *(CollisionShape("sphere", (radius,), shape.position + end) for end in (along, -along)),
    ]
    return "".join(visual_elements(part, material) for part in parts)


def _geometry(shape: CollisionShape) -> str:
    size = [f"{value:.10g}" for value in shape.size]
    inside = {
        "box": f'<box size="{" ".join(size)}"/>',
        "sphere": f'<sphere radius="{size[0]}"/>',
        "cylinder": f'<cylinder radius="{size[0]}" length="{size[-1]}"/>',
        "capsule": f'<capsule radius="{size[0]}" length="{size[-1]}"/>',
        "mesh": f'<mesh filename="{shape.file}" scale="{" ".join(size)}"/>',
    }
    return f"<geometry>{inside[shape.kind]}</geometry>"
