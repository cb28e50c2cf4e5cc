"""Files of meshes for tests, made where they are needed."""

from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

Array = NDArray[np.float64]
CUBE: Array = np.array(list(product((-0.5, 0.5), repeat=3)))
"""Corners of a cube with edges of 1."""


def write_obj(folder: Path, corners: Array, leave_out: int = 0) -> Path:
    """The convex hull of some points (n, 3) as an OBJ file, without its first faces where they are to be left out."""
    file = folder / "object.obj"
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in corners.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in _outward_faces(corners)[leave_out:]]
    file.write_text("\n".join([*lines, ""]))
    return file


def write_stl(folder: Path, corners: Array) -> Path:
    """The same as an STL file of text."""
    file = folder / "object.stl"
    lines = ["solid object"]
    for face in _outward_faces(corners):
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x!r} {y!r} {z!r}" for x, y, z in corners[list(face)].tolist()]
        lines += ["endloop", "endfacet"]
    file.write_text("\n".join([*lines, "endsolid object", ""]))
    return file


def write_hollow(folder: Path) -> Path:
    """A bar of 80 mm with a profile like an L: three quarters of a square, closed."""
    profile = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]) * 0.04
    count = len(profile)
    corners = [[x, y, z] for z in (0.0, 0.08) for x, y in profile.tolist()]
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in corners]
    ends = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    faces = [(a, c, b) for a, b, c in ends] + [(a + count, b + count, c + count) for a, b, c in ends]
    for k in range(count):
        following = (k + 1) % count
        faces += [(k, following, following + count), (k, following + count, k + count)]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    file = folder / "hollow.obj"
    file.write_text("\n".join([*lines, ""]))
    return file


def _outward_faces(corners: Array) -> list[tuple[int, int, int]]:
    hull, faces = ConvexHull(corners), []
    for (a, b, c), plane in zip(hull.simplices.tolist(), hull.equations, strict=True):
        normal = np.cross(corners[b] - corners[a], corners[c] - corners[a])
        faces.append((a, b, c) if normal @ plane[:3] > 0 else (a, c, b))
    return faces
