"""Collision shapes of a URDF, and the elements that say them."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

from tactile_cube.errors import InputError
from tactile_cube.hand.hand import Array, CollisionShape
from tactile_cube.hand.urdf import origin_element
from tactile_cube.hand.urdf_elements import Placement, number, placement_of, triple
from tactile_cube.hand.urdf_files import require_mesh


def read_shapes(link: ElementTree.Element, place: Placement) -> list[CollisionShape]:
    """Collision shapes of a link whose frame sits at `place`, in the frame that `place` is given in.

    Args:
        link: element of a URDF whose files have absolute names.
        place: where its frame is.

    Raises:
        InputError: a shape that no engine has, a mesh that none reads.
    """
    found, where = [], f"link '{link.get('name')}'"
    for collision in link.findall("collision"):
        geometry = collision.find("geometry")
        kinds = list(geometry) if geometry is not None else []
        if len(kinds) != 1:
            raise InputError(f"URDF: a <collision> of {where} has {len(kinds)} geometries; give one")
        at = place.then(placement_of(collision, where))
        found.append(_shape(kinds[0], at, where))
    return found


def _shape(element: ElementTree.Element, at: Placement, where: str) -> CollisionShape:
    kind = element.tag
    if kind == "box":
        return CollisionShape("box", tuple(triple(element, "size", where).tolist()), at.translation, at.rotation)
    if kind == "sphere":
        return CollisionShape("sphere", (number(element, "radius", where, 0.0),), at.translation, at.rotation)
    if kind == "cylinder" or kind == "capsule":
        size = (number(element, "radius", where, 0.0), number(element, "length", where, 0.0))
        return CollisionShape("cylinder" if kind == "cylinder" else "capsule", size, at.translation, at.rotation)
    if kind == "mesh":
        scale = tuple(triple(element, "scale", where).tolist()) if element.get("scale") else (1.0, 1.0, 1.0)
        file = Path(element.get("filename", ""))
        require_mesh(file, where)
        return CollisionShape("mesh", scale, at.translation, at.rotation, str(file))
    raise InputError(f"URDF: {where} has the shape <{kind}>; use box, sphere, cylinder, capsule or mesh")


def collision_element(shape: CollisionShape) -> str:
    """A shape as URDF's <collision>."""
    return f"<collision>{origin_element(shape.position, shape.rotation)}{_geometry(shape)}</collision>"


def visual_elements(shape: CollisionShape, material: str) -> str:
    """A shape as <visual> elements that every reader can draw: a capsule as a cylinder and two spheres."""
    if shape.kind != "capsule":
        return f"<visual>{origin_element(shape.position, shape.rotation)}{_geometry(shape)}{material}</visual>"
    radius, length = shape.size
    along = 0.5 * length * shape.rotation[:, 2]
    parts = [
        CollisionShape("cylinder", (radius, length), shape.position, shape.rotation),
        *(CollisionShape("sphere", (radius,), shape.position + end, np.eye(3)) for end in (along, -along)),
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


def moved(shape: CollisionShape, rotation: Array) -> CollisionShape:
    """A shape seen from axes that are turned by `rotation` (3, 3) in those it is given in."""
    return CollisionShape(shape.kind, shape.size, rotation.T @ shape.position, rotation.T @ shape.rotation, shape.file)
