"""What the object is, and where a fingertip touches its side."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from tactile_cube.hand.object_mesh import ObjectMesh

Array = NDArray[np.float64]
NamedShape = Literal["box", "cylinder", "capsule"]
ObjectShape = NamedShape | ObjectMesh
"""Within a bounding box (x, y, z): a box; an upright cylinder of diameter x; a bar with half spheres of diameter x at
its ends, which is a sphere where z equals x; or a convex mesh."""
SHAPES: tuple[NamedShape, ...] = get_args(NamedShape)

_SHARE = 0.7
"""How far from the middle of a side towards its edges a fingertip is put."""
_ARC = np.radians(30.0)
"""The same around a round side [rad]."""


def straight_half(half: Array) -> float:
    """Half the length of a capsule's straight part [m], from half the edges of its bounding box (3,) [m]."""
    return max(float(half[2] - half[0]), 0.0)


def unit_inertia(shape: ObjectShape, size: Array) -> Array:
    """Inertia (3, 3) [m^2] about the centre of mass of a solid of 1 kg with a bounding box `size` (3,) [m]."""
    return shape.inertia(size) if isinstance(shape, ObjectMesh) else np.diag(_moments(shape, size))


def _moments(shape: NamedShape, size: Array) -> Array:
    if shape == "box":
        return np.asarray((np.sum(size**2) - size**2) / 12.0)
    radius = 0.5 * float(size[0])
    if shape == "cylinder":
        across = (3.0 * radius**2 + float(size[2]) ** 2) / 12.0
        return np.array([across, across, 0.5 * radius**2])
    length = 2.0 * straight_half(0.5 * size)
    bar = length / (length + 4.0 / 3.0 * radius)  # share of the mass in the straight part
    ends = 1.0 - bar
    across = bar * (3.0 * radius**2 + length**2) / 12.0
    across += ends * (0.4 * radius**2 + 0.25 * length**2 + 0.375 * length * radius)
    return np.array([across, across, (0.5 * bar + 0.4 * ends) * radius**2])


def tip_centres(shape: ObjectShape, side: Array, half: Array, radius: float, gap: float) -> Array:
    """Centres (n, 3) [m] of a sphere that stands at a side of the object, the most wanted place first.

    Args:
        shape: what the object is.
        side: horizontal unit vector towards the finger (3,), in the object's frame.
        half: half the edges of its bounding box (3,) [m].
        radius: of the sphere [m].
        gap: between sphere and object [m]; negative: it presses.
    """
    if shape == "box":
        face, aim = _face_of(side, half)
        return np.asarray(face * (half + radius + gap) + _on_face(face, half, aim))
    height = straight_half(half) if shape == "capsule" else half[2]
    turns, ups = np.linspace(-_ARC, _ARC, 15), np.linspace(-_SHARE, _SHARE, 9) * height
    turn, up = (grid.ravel() for grid in np.meshgrid(turns, ups, indexing="ij"))
    order = np.argsort(np.hypot(half[0] * turn, up), kind="stable")
    angle = np.arctan2(side[1], side[0]) + turn[order]
    if isinstance(shape, ObjectMesh):
        centre = 2.0 * half * shape.com
        from_axis = np.stack([np.full_like(angle, centre[0]), np.full_like(angle, centre[1]), up[order]], axis=1)
        outwards = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
        points, normals = shape.surface(2.0 * half, from_axis, outwards)
        return np.asarray(points + (radius + gap) * normals)
    reach = half[0] + radius + gap
    return np.stack([reach * np.cos(angle), reach * np.sin(angle), up[order]], axis=1)


def _face_of(side: Array, half: Array) -> tuple[Array, Array]:
    """Outward normal (3,) of the face that a ray from the middle meets, and where, from the face's middle (3,)."""
    axis = int(np.argmax(np.abs(side) / half))
    normal = np.zeros(3)
    normal[axis] = np.sign(side[axis])
    if np.array_equal(normal, side):
        return np.asarray(side, dtype=np.float64), np.zeros(3)
    return normal, np.asarray(side * (half[axis] / abs(side[axis])) * (1.0 - np.abs(normal)))


def _on_face(face: Array, half: Array, aim: Array) -> Array:
    """Grid of points on a face relative to its middle (n, 3) [m], nearest to `aim` first."""
    sideways = np.cross([0.0, 0.0, 1.0], face)
    across = np.linspace(-_SHARE, _SHARE, 15) * float(np.abs(sideways) @ half)
    up = np.linspace(-_SHARE, _SHARE, 9) * half[2]
    grid = np.array([s * sideways + np.array([0.0, 0.0, z]) for s in across for z in up])
    return grid[np.argsort(np.linalg.norm(grid - aim, axis=1), kind="stable")]
