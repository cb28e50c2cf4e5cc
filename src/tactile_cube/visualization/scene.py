"""The hand and an object with six distinguishable sides in PyBullet's software renderer."""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pybullet
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

from tactile_cube.evaluation.episode_record import Array
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.hand.object_mesh import ObjectMesh, ObjectShape, straight_half

Colour = tuple[float, float, float]

SIDES = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], dtype=np.float64)
RED: Colour = (0.85, 0.15, 0.15)
SIDE_COLOURS: tuple[Colour, ...] = (
    RED, (0.95, 0.60, 0.10), (0.15, 0.60, 0.20), (0.15, 0.35, 0.85), (0.95, 0.90, 0.20), (0.92, 0.92, 0.92),
)  # fmt: skip
DARK: Colour = (0.12, 0.12, 0.12)
GREY: Colour = (0.30, 0.30, 0.32)
STICKER = 0.84
"""Edge of the coloured sticker as a share of the cube's edge: a dark frame remains, so edges stay visible."""
STICKER_HEIGHT = 0.0006
WEIGHT = '<inertial><mass value="0.01"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>'
"""Nothing moves here by itself; without it PyBullet warns about the palm."""
LINK_COLOUR = (0.62, 0.66, 0.72, 1.0)
TIP_COLOUR = (0.20, 0.22, 0.26, 1.0)


@dataclass(frozen=True)
class Part:
    """A solid of which the drawn object is made.

    Attributes:
        kind: a cylinder stands upright.
        size: edges of its bounding box `(3,)`; of a mesh the corners of its triangles `(n, 3, 3)` [m].
        centre: in the object `(3,)` [m].
        colour: red, green and blue, 0 to 1.
    """

    kind: Literal["box", "cylinder", "sphere", "mesh"]
    size: Array
    centre: Array
    colour: Colour


def object_parts(size: Array, shape: ObjectShape = "box") -> list[Part]:
    """Return what an object is drawn with: sides of different colours show how it is turned.

    A cube has a sticker on each side, a round object four stripes, both a bar on the lower side that shows a turn from
    below; a mesh is painted by where its faces look.

    Args:
        size: edge lengths of its bounding box `(3,)` [m].
        shape: what it is.
    """
    middle, parts = np.zeros(3), list[Part]()
    if isinstance(shape, ObjectMesh):
        corners = (shape.vertices * size)[shape.faces]
        looks = np.argmax(_normals(corners) @ SIDES.T, axis=1)
        return [Part("mesh", corners[looks == k], middle, SIDE_COLOURS[k]) for k in np.unique(looks).tolist()]
    if shape == "box":
        parts.append(Part("box", size, middle, DARK))
        for side, colour in zip(SIDES, SIDE_COLOURS, strict=True):
            parts.append(Part("box", np.where(side != 0, STICKER_HEIGHT, STICKER * size), side * size / 2, colour))
    else:
        radius = 0.5 * float(size[0])
        length = 2.0 * straight_half(0.5 * size) if shape == "capsule" else float(size[2])
        parts.append(Part("cylinder", np.array([size[0], size[0], length]), middle, GREY))
        if shape == "capsule":
            ends = (np.array([0.0, 0.0, end]) for end in (0.5 * length, -0.5 * length))
            parts += [Part("sphere", np.full(3, size[0]), end, GREY) for end in ends]
        for side, colour in zip(SIDES[:4], SIDE_COLOURS[:4], strict=True):
            stripe = np.where(side != 0, 0.06, 0.22) * size[0]
            stripe[2] = max(0.9 * length, 0.2 * radius)
            parts.append(Part("box", stripe, side * radius * 0.96, colour))
    return [*parts, Part("box", size * [0.40, 0.10, 0.03], size * [0.20, 0.0, -0.5], RED)]


def _normals(corners: Array) -> Array:
    """Return the directions in which triangles `(n, 3, 3)` look `(n, 3)`."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


@dataclass(frozen=True)
class Camera:
    """A view on the cube: angles of `computeViewMatrixFromYawPitchRoll` [deg], distance and height [m]."""

    yaw: float
    pitch: float
    distance: float
    height: float = 0.0


SIDE = Camera(yaw=35.0, pitch=-10.0, distance=0.33, height=0.03)
BELOW = Camera(yaw=0.0, pitch=72.0, distance=0.30)
ABOVE = Camera(yaw=0.0, pitch=-72.0, distance=0.36, height=-0.05)  # of a hand that lies palm up


class Scene:
    """Poses hand and object and takes pictures; owns one PyBullet client until `close`."""

    def __init__(self, cube_size: Array, hand: Hand = DLR_HAND2, shape: ObjectShape = "box") -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        self._hand, self._columns = self._load(hand)
        parts = object_parts(cube_size, shape)
        count = len(parts)
        self._cube = pybullet.createMultiBody(
            linkMasses=[0.0] * count,
            linkCollisionShapeIndices=[-1] * count,
            linkVisualShapeIndices=[self._visual(part) for part in parts],
            linkPositions=[part.centre.tolist() for part in parts],
            linkOrientations=[(0.0, 0.0, 0.0, 1.0)] * count,
            linkInertialFramePositions=[(0.0, 0.0, 0.0)] * count,
            linkInertialFrameOrientations=[(0.0, 0.0, 0.0, 1.0)] * count,
            linkParentIndices=[0] * count,
            linkJointTypes=[pybullet.JOINT_FIXED] * count,
            linkJointAxis=[(0.0, 0.0, 1.0)] * count,
            physicsClientId=self._client,
        )

    def close(self) -> None:
        """Give the client back."""
        pybullet.disconnect(self._client)

    def pose(self, joint_position: Array, cube_position: Array, cube_quaternion: Array) -> None:
        """Place the hand's joints (the coupled ones follow) and the object."""
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
        projection = pybullet.computeProjectionMatrixFOV(45.0, width / height, 0.02, 2.0)
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

    def _visual(self, part: Part) -> int:
        look: dict[str, Any]
        if part.kind == "mesh":  # without normals none of it is drawn
            normals, corners = np.repeat(_normals(part.size), 3, axis=0).tolist(), part.size.reshape(-1, 3).tolist()
            look = {"vertices": corners, "indices": list(range(len(corners))), "normals": normals}
        else:
            half, length = part.size / 2, part.size[2]
            round_one = {"radius": half[0], "length": length} if part.kind == "cylinder" else {"radius": half[0]}
            look = {"halfExtents": half.tolist()} if part.kind == "box" else round_one
        look["shapeType"] = getattr(pybullet, f"GEOM_{part.kind.upper()}")
        return int(pybullet.createVisualShape(rgbaColor=[*part.colour, 1.0], physicsClientId=self._client, **look))

    def _load(self, hand: Hand) -> tuple[int, dict[int, int]]:
        """Load and paint the hand; gives its body and, by PyBullet's index of a joint, the column of q it reads."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "hand.urdf"
            path.write_text(hand.urdf().replace('<link name="palm">', f'<link name="palm">{WEIGHT}'), encoding="utf-8")
            body = int(pybullet.loadURDF(str(path), useFixedBase=True, physicsClientId=self._client))
        orientation = Rotation.from_matrix(hand.rotation).as_quat()
        pybullet.resetBasePositionAndOrientation(body, hand.position, orientation, physicsClientId=self._client)
        pybullet.changeVisualShape(body, -1, rgbaColor=LINK_COLOUR, physicsClientId=self._client)
        tips, columns = tuple(finger.links[-1] for finger in hand.fingers), {}
        for index in range(pybullet.getNumJoints(body, physicsClientId=self._client)):
            about = pybullet.getJointInfo(body, index, physicsClientId=self._client)
            colour = TIP_COLOUR if about[12].decode().endswith(tips) else LINK_COLOUR
            pybullet.changeVisualShape(body, index, rgbaColor=colour, physicsClientId=self._client)
            actuated = hand.followed(about[1].decode())  # of a coupled joint the one that it follows
            if actuated in hand.joint_names:
                columns[index] = list(hand.joint_names).index(actuated)
        return body, columns
