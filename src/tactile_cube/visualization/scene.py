"""The hand and a cube with six distinguishable faces in PyBullet's software renderer."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pybullet
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

from tactile_cube.evaluation.episode_record import Array
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.hand.object_mesh import ObjectMesh
from tactile_cube.hand.object_shape import NamedShape, ObjectShape, straight_half

FACE_COLOURS = {
    "+x": (0.85, 0.15, 0.15),
    "-x": (0.95, 0.60, 0.10),
    "+y": (0.15, 0.60, 0.20),
    "-y": (0.15, 0.35, 0.85),
    "+z": (0.95, 0.90, 0.20),
    "-z": (0.92, 0.92, 0.92),
}
FACE_NORMALS = {
    "+x": (1, 0, 0),
    "-x": (-1, 0, 0),
    "+y": (0, 1, 0),
    "-y": (0, -1, 0),
    "+z": (0, 0, 1),
    "-z": (0, 0, -1),
}
STICKER = 0.84
"""Edge of the coloured sticker as a share of the cube's edge: a dark frame remains, so edges stay visible."""
STICKER_HEIGHT = 0.0006
MESH_FILE = "object.obj"
WEIGHT = '<inertial><mass value="0.01"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>'
"""Nothing moves here by itself; without it PyBullet warns about every link."""
LINK_COLOUR = (0.62, 0.66, 0.72, 1.0)
TIP_COLOUR = (0.20, 0.22, 0.26, 1.0)


@dataclass(frozen=True)
class Camera:
    """A view on the cube: angles of `computeViewMatrixFromYawPitchRoll` [deg], distance [m], field of view [deg]."""

    yaw: float
    pitch: float
    distance: float = 0.36
    field_of_view: float = 45.0
    height: float = 0.0


SIDE = Camera(yaw=35.0, pitch=-10.0, distance=0.33, height=0.03)
BELOW = Camera(yaw=0.0, pitch=72.0, distance=0.30)


def object_urdf(size: Array, shape: ObjectShape = "box") -> str:
    """Return the object: a cube with a coloured sticker on each face, a round one with four coloured stripes.

    Both have a bar on the lower side.

    Args:
        size: edge lengths of its bounding box `(3,)` [m].
        shape: what it is.
    """
    if isinstance(shape, ObjectMesh):
        return _mesh_urdf(size)
    return cube_urdf(size) if shape == "box" else _round_urdf(size, shape)


def _mesh_urdf(size: Array) -> str:
    """A mesh whose file stands beside the URDF, stretched, with a small bar that shows how it is turned from below."""
    scale = " ".join(f"{edge:.6f}" for edge in size)
    body = _part(f'<mesh filename="{MESH_FILE}" scale="{scale}"/>', (0.0, 0.0, 0.0), "body", (0.55, 0.55, 0.58))
    return _urdf([body, _box(size * [0.40, 0.10, 0.03], size * [0.20, 0.0, -0.5], "bar", (0.85, 0.15, 0.15))])


def obj_text(mesh: ObjectMesh) -> str:
    """A mesh as the text of an OBJ file, each face with corners and a normal of its own; without one none is drawn."""
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in corners.reshape(-1, 3)]
    lines += [f"vn {x:.6f} {y:.6f} {z:.6f}" for x, y, z in normals]
    lines += [f"f {3 * k + 1}//{k + 1} {3 * k + 2}//{k + 1} {3 * k + 3}//{k + 1}" for k in range(len(normals))]
    return "\n".join([*lines, ""])


def _round_urdf(size: Array, shape: NamedShape) -> str:
    radius, length = 0.5 * float(size[0]), 2.0 * straight_half(0.5 * size) if shape == "capsule" else float(size[2])
    ends = [0.5 * length, -0.5 * length] if shape == "capsule" else []
    grey = (0.30, 0.30, 0.32)
    shapes = [_part(f'<cylinder radius="{radius:.6f}" length="{length:.6f}"/>', (0.0, 0.0, 0.0), "body", grey)]
    shapes += [_part(f'<sphere radius="{radius:.6f}"/>', (0.0, 0.0, z), f"end{z:+.4f}", grey) for z in ends]
    for face in ("+x", "-x", "+y", "-y"):
        normal = np.array(FACE_NORMALS[face])
        extent = np.where(np.abs(normal) == 1, 0.06, 0.22) * size[0]
        extent[2] = max(0.9 * length, 0.2 * radius)
        shapes.append(_box(extent, normal * radius * 0.96, f"stripe{face}", FACE_COLOURS[face]))
    shapes.append(_box(size * [0.40, 0.10, 0.03], size * [0.20, 0.0, -0.5], "bar", (0.85, 0.15, 0.15)))
    return _urdf(shapes)


def cube_urdf(size: Array) -> str:
    """Return a cube with a dark frame, a coloured sticker on each face, and a bar on the lower face.

    Args:
        size: edge lengths `(3,)` [m].
    """
    shapes = [_box(size, (0.0, 0.0, 0.0), "frame", (0.12, 0.12, 0.12))]
    for face, normal in FACE_NORMALS.items():
        axis = np.abs(normal)
        extent = np.where(axis == 1, STICKER_HEIGHT, STICKER * size)
        centre = np.asarray(normal) * size / 2
        shapes.append(_box(extent, centre, f"face{face}", FACE_COLOURS[face]))
    # The bar from the centre of the lower face to its +x edge makes a turn visible from below.
    shapes.append(_box(size * [0.40, 0.10, 0.03], size * [0.20, 0.0, -0.5], "bar", (0.85, 0.15, 0.15)))
    return _urdf(shapes)


def _box(extent: Array, centre: Array | tuple[float, ...], name: str, colour: tuple[float, ...]) -> tuple[str, str]:
    numbers = " ".join(f"{value:.6f}" for value in extent)
    return _part(f'<box size="{numbers}"/>', centre, name, colour)


def _part(geometry: str, centre: Array | tuple[float, ...], name: str, colour: tuple[float, ...]) -> tuple[str, str]:
    place = " ".join(f"{value:.6f}" for value in centre)
    rgb = " ".join(str(value) for value in colour)
    link = (
        f'<link name="{name}">{WEIGHT}<visual><geometry>{geometry}</geometry>'
        f'<material name="{name}"><color rgba="{rgb} 1"/></material></visual></link>'
    )
    joint = (
        f'<joint name="{name}_joint" type="fixed"><parent link="cube"/><child link="{name}"/>'
        f'<origin xyz="{place}"/></joint>'
    )
    return link, joint


def _urdf(shapes: list[tuple[str, str]]) -> str:
    body = "".join(link + joint for link, joint in shapes)
    return f'<robot name="cube"><link name="cube">{WEIGHT}</link>{body}</robot>'


class Scene:
    """Poses hand and cube and takes pictures; owns one PyBullet client until `close`."""

    def __init__(self, cube_size: Array, hand: Hand = DLR_HAND2, shape: ObjectShape = "box") -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        self._hand = self._load(hand.urdf())
        self._cube = self._load(object_urdf(cube_size, shape), shape)
        orientation = Rotation.from_matrix(hand.rotation).as_quat()
        pybullet.resetBasePositionAndOrientation(self._hand, hand.position, orientation, physicsClientId=self._client)
        self._columns = self._joint_columns(hand)
        self._tips = {hand.fingers[k].links[-1] for k in range(len(hand.fingers))}
        self._paint()

    def close(self) -> None:
        """Give the client back."""
        pybullet.disconnect(self._client)

    def pose(self, joint_position: Array, cube_position: Array, cube_quaternion: Array) -> None:
        """Place the hand's joints (the coupled ones follow) and the cube."""
        for joint, column in self._columns.items():
            pybullet.resetJointState(self._hand, joint, joint_position[column], physicsClientId=self._client)
        pybullet.resetBasePositionAndOrientation(
            self._cube, cube_position, cube_quaternion, physicsClientId=self._client
        )

    def picture(self, camera: Camera, width: int, height: int) -> Image.Image:
        """Return what a camera sees."""
        view = pybullet.computeViewMatrixFromYawPitchRoll(
            [0.0, 0.0, camera.height], camera.distance, camera.yaw, camera.pitch, 0.0, upAxisIndex=2
        )
        projection = pybullet.computeProjectionMatrixFOV(camera.field_of_view, width / height, 0.02, 2.0)
        _, _, pixels, _, _ = pybullet.getCameraImage(
            width,
            height,
            view,
            projection,
            shadow=0,
            lightDirection=[0.4, -0.5, 1.0 if camera.pitch < 0 else -1.0],
            lightAmbientCoeff=0.65,
            lightDiffuseCoeff=0.45,
            lightSpecularCoeff=0.0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        array: NDArray[np.uint8] = np.reshape(np.asarray(pixels, dtype=np.uint8), (height, width, 4))
        return Image.fromarray(array[:, :, :3].copy())

    def _load(self, urdf: str, shape: ObjectShape = "box") -> int:
        with tempfile.TemporaryDirectory() as folder:
            if isinstance(shape, ObjectMesh):
                (Path(folder) / MESH_FILE).write_text(obj_text(shape), encoding="utf-8")
            path = Path(folder) / "body.urdf"
            path.write_text(urdf.replace('<link name="palm">', f'<link name="palm">{WEIGHT}'), encoding="utf-8")
            return int(pybullet.loadURDF(str(path), useFixedBase=True, physicsClientId=self._client))

    def _joint_columns(self, hand: Hand) -> dict[int, int]:
        """Map PyBullet's joint index to the column of q; a coupled joint reads that of the one it follows."""
        columns = {}
        for index in range(pybullet.getNumJoints(self._hand, physicsClientId=self._client)):
            name = pybullet.getJointInfo(self._hand, index, physicsClientId=self._client)[1].decode()
            actuated = hand.followed(name)
            if actuated in hand.joint_names:
                columns[index] = list(hand.joint_names).index(actuated)
        return columns

    def _paint(self) -> None:
        for index in range(-1, pybullet.getNumJoints(self._hand, physicsClientId=self._client)):
            name = "palm"
            if index >= 0:
                name = pybullet.getJointInfo(self._hand, index, physicsClientId=self._client)[12].decode()
            colour = TIP_COLOUR if name.endswith(tuple(self._tips)) else LINK_COLOUR
            pybullet.changeVisualShape(self._hand, index, rgbaColor=colour, physicsClientId=self._client)
