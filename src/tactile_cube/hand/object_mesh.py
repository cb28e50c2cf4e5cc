"""Objects: box, cylinder, capsule, or a convex solid from a mesh, in plain numbers that every engine can build."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.untrusted_file import regular

if TYPE_CHECKING:
    from trimesh import Trimesh


Array = NDArray[np.float64]
ENDINGS = (".obj", ".stl")
SMALLEST, LARGEST = 0.01, 0.5
"""Longest edge of the bounding box that an object for fingers may have [m]: a fingertip's diameter is about 0.025 m."""
UNITS = {0.001: "millimetres", 0.01: "centimetres", 0.0254: "inches"}
CONVEX = 0.95
"""Share of its convex hull that a mesh must fill: contacts are then where they would be but for 5 % of the volume."""
CORNERS = 200
"""Maximum corners of a hull, as every contact costs time for each. On a sphere of 80 mm they are 0.3 mm off."""


@dataclass(frozen=True, eq=False)
class ObjectMesh:
    """A convex solid of constant density whose bounding box has edges of 1 and its middle at the origin.

    The bounding box of an episode's object scales it.

    Attributes:
        vertices: its corners (n, 3).
        faces: triangles of corners, counterclockwise from outside (m, 3).
        volume: of the solid.
        com: its centre of mass (3,).
        moments: second moments of a mass of 1 about the centre of mass (3, 3).
        file: that it comes from.
    """

    vertices: Array
    faces: NDArray[np.int64]
    volume: float
    com: Array
    moments: Array
    file: str = ""

    def __str__(self) -> str:
        return f"mesh {hashlib.sha256(self.vertices.tobytes()).hexdigest()[:12]}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ObjectMesh) and (self is other or np.array_equal(self.vertices, other.vertices))

    def __hash__(self) -> int:
        return hash(self.vertices.tobytes())

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all attributes as arrays, for a file."""
        return {name: np.asarray(value) for name, value in vars(self).items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> ObjectMesh:
        """Make a mesh from the output of `arrays`."""
        vertices, faces, com, moments = (arrays[name] for name in ("vertices", "faces", "com", "moments"))
        return cls(vertices, faces, float(arrays["volume"]), com, moments, str(arrays["file"]))

    def inertia(self, size: Array) -> Array:
        """Return the inertia (3, 3) [m^2] about the centre of mass of 1 kg with a bounding box `size` (3,) [m]."""
        moments = np.diag(size) @ self.moments @ np.diag(size)
        return np.asarray(np.trace(moments) * np.eye(3) - moments)

    def surface(self, size: Array, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Find where rays from `origins` along unit vectors `directions` (n, 3) leave the solid of `size` (3,) [m].

        Return points (k, 3) [m] and outward normals (k, 3) of the k <= n rays that begin inside.
        """
        planes = ConvexHull(self.vertices * size).equations  # normal @ x + offset <= 0 inside
        depth = -(origins @ planes[:, :3].T + planes[:, 3])
        inside = np.all(depth > 0.0, axis=1)
        speed = directions[inside] @ planes[:, :3].T
        with np.errstate(divide="ignore"):
            ways = np.where(speed > 1e-12, depth[inside] / speed, np.inf)
        first = np.argmin(ways, axis=1)
        way = np.take_along_axis(ways, first[:, None], axis=1)
        return origins[inside] + way * directions[inside], planes[first, :3]


def read_mesh(file: str | Path, scale: float = 1.0, hull: bool = False) -> tuple[ObjectMesh, Array]:
    """Read an OBJ or STL file, whose axes are the object's, and the edges of its bounding box (3,) [m].

    `scale` is metres per unit of the file; with `hull` a hollow or open mesh is taken as its convex hull.

    Raises:
        InputError: there is no such file, no mesh in it, its size is none for fingers, or it is not convex.
    """
    where = f"object.file={file}"
    if not scale > 0.0:
        raise InputError(f"object.scale is {scale}; give metres per unit of {file}, above 0")
    solid = _loaded(Path(file), where)
    _refuse_odd_size(solid.extents * scale, scale, where)
    convex = solid.convex_hull
    remedy = "object.hull=true takes its convex hull"
    if not (hull or solid.is_volume):
        raise InputError(f"{where}: its surface is not closed, or not all faces look outwards; mend it, or {remedy}")
    share = float(solid.volume / convex.volume)
    if not hull and share < CONVEX:
        raise InputError(
            f"{where}: fills {100 * share:.0f} % of its convex hull; the engines need convex ones: {remedy}"
        )
    massive = solid if solid.is_volume else convex
    low, high = convex.bounds
    middle, size = 0.5 * (low + high), high - low
    corners, faces = _outline((convex.vertices - middle) / size)
    inertia = np.asarray(massive.moment_inertia / massive.volume, dtype=np.float64)
    moments = (0.5 * np.trace(inertia) * np.eye(3) - inertia) / np.outer(size, size)
    com = np.round((massive.center_mass - middle) / size, 9)  # 0 where it is meant to be
    volume = float(massive.volume / np.prod(size))
    return ObjectMesh(corners, faces, volume, com, moments, str(file)), np.asarray(scale * size)


def _loaded(path: Path, where: str) -> Trimesh:
    import trimesh  # imports slowly

    if path.suffix.lower() not in ENDINGS:
        raise InputError(f"{where}: ending {path.suffix!r} is unknown; give a mesh as {' or '.join(ENDINGS)}")
    content = BytesIO(regular(path, limits.MESH, f"; a relative name is looked for in {Path.cwd()}").read_bytes())
    try:
        solid: Any = trimesh.load_mesh(content, path.suffix, skip_materials=True)  # bytes can name no other file
        if isinstance(solid, trimesh.Scene):
            solid = solid.to_mesh()
        volume = float(solid.convex_hull.volume)
    except Exception as error:  # trimesh and qhull raise their own kinds for each damage
        raise InputError(f"{where}: no mesh could be read from it: {str(error).splitlines()[0]}") from error
    if not (np.isfinite(solid.vertices).all() and volume > 0.0):
        raise InputError(f"{where}: its {len(solid.vertices)} points enclose no volume; give a solid")
    found: Trimesh = solid
    return found


def _refuse_odd_size(size: Array, scale: float, where: str) -> None:
    longest = float(size.max())
    if SMALLEST <= longest <= LARGEST:
        return
    likely = [unit for unit in UNITS if 0.03 <= longest * unit / scale <= 0.3]
    hint = f"; in {UNITS[likely[0]]} it needs object.scale={likely[0]:g}" if likely else ""
    raise InputError(
        f"{where}: is {' x '.join(f'{edge:.4g}' for edge in size)} m with object.scale={scale:g} (metres per unit of "
        f"the file); fingers turn objects of {SMALLEST} to {LARGEST} m{hint}"
    )


def _outline(vertices: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return corners and triangles of a hull; of more than `CORNERS` those that lie outermost in so many directions."""
    chosen = vertices[ConvexHull(vertices).vertices]
    if len(chosen) > CORNERS:
        kept = np.unique(np.argmax(_directions(CORNERS - 6) @ chosen.T, axis=1))
        extremes = np.concatenate([chosen.argmin(axis=0), chosen.argmax(axis=0)])
        chosen = chosen[np.union1d(kept, extremes)]
    hull = ConvexHull(chosen)
    corners = chosen[hull.simplices]
    outwards = np.einsum("ij,ij->i", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
                         hull.equations[:, :3]) > 0.0  # fmt: skip
    faces = np.where(outwards[:, None], hull.simplices, hull.simplices[:, ::-1])
    return np.asarray(chosen, dtype=np.float64), faces.astype(np.int64)


def _directions(count: int) -> Array:
    """Return the unit vectors (count, 3), evenly spread: a Fibonacci lattice."""
    rank = np.arange(count) + 0.5
    height, turn = 1.0 - 2.0 * rank / count, np.pi * (1.0 + 5.0**0.5) * rank
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)


NamedShape = Literal["box", "cylinder", "capsule"]
ObjectShape = NamedShape | ObjectMesh
"""Within a bounding box (x, y, z): a box; an upright cylinder of diameter x; a bar with half spheres of diameter x at
its ends, which is a sphere where z equals x; or a convex mesh."""
SHAPES: tuple[NamedShape, ...] = get_args(NamedShape)

_SHARE = 0.7  # how far from the middle of a side towards its edges a fingertip is put
_ARC = np.radians(30.0)  # the same around a round side [rad]


def straight_half(half: Array) -> float:
    """Return half the length of a capsule's straight part [m], from half the edges of its bounding box (3,) [m]."""
    return max(float(half[2] - half[0]), 0.0)


def unit_inertia(shape: ObjectShape, size: Array) -> Array:
    """Return inertia (3, 3) [m^2] about the centre of mass of a solid of 1 kg with a bounding box `size` (3,) [m]."""
    if isinstance(shape, ObjectMesh):
        return shape.inertia(size)
    if shape == "box":
        return np.diag((np.sum(size**2) - size**2) / 12.0)
    radius = 0.5 * float(size[0])
    if shape == "cylinder":
        across = (3.0 * radius**2 + float(size[2]) ** 2) / 12.0
        return np.diag([across, across, 0.5 * radius**2])
    length = 2.0 * straight_half(0.5 * size)
    bar = length / (length + 4.0 / 3.0 * radius)  # share of the mass in the straight part
    ends = 1.0 - bar
    across = bar * (3.0 * radius**2 + length**2) / 12.0
    across += ends * (0.4 * radius**2 + 0.25 * length**2 + 0.375 * length * radius)
    return np.diag([across, across, (0.5 * bar + 0.4 * ends) * radius**2])


def tip_centres(shape: ObjectShape, side: Array, half: Array, radius: float, gap: float) -> Array:
    """Return the centres (n, 3) [m] of a sphere that stands at a side of the object, the most wanted place first.

    `side` (3,) is the horizontal unit vector towards the finger, in the object's frame, `half` (3,) half the edges of
    its bounding box, `gap` between sphere and object [m]; negative: it presses.
    """
    if shape == "box":
        face, places = _on_face(side, half)
        return np.asarray(face * (half + radius + gap) + places)
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


def _on_face(side: Array, half: Array) -> tuple[Array, Array]:
    """Return the normal (3,) of the face that a ray from the middle meets, and a grid on it, nearest to the ray first.

    The grid (n, 3) [m] is relative to the face's middle.
    """
    axis = int(np.argmax(np.abs(side) / half))
    face, aim = np.zeros(3), np.zeros(3)
    face[axis] = np.sign(side[axis])
    if np.array_equal(face, side):
        face = np.asarray(side, dtype=np.float64)
    else:
        aim = side * (half[axis] / abs(side[axis])) * (1.0 - np.abs(face))
    sideways = np.cross([0.0, 0.0, 1.0], face)
    across = np.linspace(-_SHARE, _SHARE, 15) * float(np.abs(sideways) @ half)
    up = np.linspace(-_SHARE, _SHARE, 9) * half[2]
    grid = np.array([s * sideways + np.array([0.0, 0.0, z]) for s in across for z in up])
    return face, grid[np.argsort(np.linalg.norm(grid - aim, axis=1), kind="stable")]
