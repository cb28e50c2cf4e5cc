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
from tactile_cube.hand import DLR_HAND2, HandModel, hand_urdf

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
    place = " ".join(f"{value:.6f}" for value in centre)
    rgb = " ".join(str(value) for value in colour)
    link = (
        f'<link name="{name}">{WEIGHT}<visual><geometry><box size="{numbers}"/></geometry>'
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

    def __init__(self, cube_size: Array, hand: HandModel = DLR_HAND2) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        self._hand = self._load(hand_urdf(hand))
        self._cube = self._load(cube_urdf(cube_size))
        orientation = Rotation.from_matrix(hand.rotation).as_quat()
        pybullet.resetBasePositionAndOrientation(self._hand, hand.position, orientation, physicsClientId=self._client)
        self._columns = self._joint_columns(hand)
        self._paint()

    def close(self) -> None:
        """Give the client back."""
        pybullet.disconnect(self._client)

    def pose(self, joint_position: Array, cube_position: Array, cube_quaternion: Array) -> None:
        """Place the hand's 12 joints (the coupled ones follow) and the cube."""
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

    def _load(self, urdf: str) -> int:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "body.urdf"
            path.write_text(urdf.replace('<link name="palm">', f'<link name="palm">{WEIGHT}'), encoding="utf-8")
            return int(pybullet.loadURDF(str(path), useFixedBase=True, physicsClientId=self._client))

    def _joint_columns(self, hand: HandModel) -> dict[int, int]:
        """Map PyBullet's joint index to the column of q; `<finger>_q4` reads the column of `<finger>_q3`."""
        columns = {}
        for index in range(pybullet.getNumJoints(self._hand, physicsClientId=self._client)):
            name = pybullet.getJointInfo(self._hand, index, physicsClientId=self._client)[1].decode()
            actuated = name.replace("_q4", "_q3")
            if actuated in hand.joint_names:
                columns[index] = list(hand.joint_names).index(actuated)
        return columns

    def _paint(self) -> None:
        for index in range(-1, pybullet.getNumJoints(self._hand, physicsClientId=self._client)):
            name = "palm"
            if index >= 0:
                name = pybullet.getJointInfo(self._hand, index, physicsClientId=self._client)[12].decode()
            colour = TIP_COLOUR if name.endswith("distal") else LINK_COLOUR
            pybullet.changeVisualShape(self._hand, index, rgbaColor=colour, physicsClientId=self._client)
