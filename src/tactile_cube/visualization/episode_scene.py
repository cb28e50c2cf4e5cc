"""An episode in 3D in Rerun: the hand from its URDF, the object, the way of its corner, the contact forces."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun as rr
from rerun.urdf import UrdfTree
from scipy.spatial.transform import Rotation

from tactile_cube.env.rotation import TOUCH_FORCE
from tactile_cube.evaluation.episode_record import Array, EpisodeRecord
from tactile_cube.hand import Hand
from tactile_cube.hand.object_mesh import ObjectMesh
from tactile_cube.visualization.rerun_recording import Branch, log_robot
from tactile_cube.visualization.scene import FACE_COLOURS, FACE_NORMALS, STICKER, STICKER_HEIGHT

FINGER_COLOURS = ((214, 69, 65), (245, 171, 53), (38, 166, 91), (65, 131, 215), (150, 90, 200), (90, 190, 200))
ARROW_LENGTH = 0.03
"""Length of a contact arrow [m/N]."""
POSE_RATE = 50.0
"""Rate of the 3D poses [Hz]: smooth to the eye; the joint signals keep the physics rate."""
TRAIL = 50
"""Policy steps for which the way of the object's corner stays visible: 5 s."""


def log_hand(branch: Branch, hand: Hand) -> UrdfTree:
    """Write the hand's URDF; gives its tree, which `log_motion` needs."""
    prefix = branch.root.replace("/", "_")
    tree = log_robot(branch.stream, hand.urdf(), branch.hand.root.rstrip("/"), prefix or None)
    root = rr.Transform3D(
        translation=hand.position,
        quaternion=rr.Quaternion(xyzw=Rotation.from_matrix(hand.rotation).as_quat()),
        parent_frame="tf#/",
        child_frame=prefix + tree.root_link().name,
    )
    branch.hand.always("pose", root)
    return tree


def log_motion(branch: Branch, record: EpisodeRecord, hand: Hand, tree: UrdfTree) -> None:
    """Write all that moves: joints (a coupled one with the angle of its neighbour), object, trail and contacts."""
    time, q, position, quaternion = _pose_samples(record)
    columns = {name: index for index, name in enumerate(hand.joint_names)}
    for joint in tree.joints():
        actuated = hand.followed(joint.name)
        if actuated in columns:
            transform = joint.compute_transform_columns(q[:, columns[actuated]].tolist(), clamp=False)
            branch.hand.columns(f"joint_transforms/{joint.name}", time, transform)
    _log_object(branch, record)
    branch.columns("cube", time, rr.Transform3D.columns(translation=position, quaternion=quaternion))
    _log_trail(branch, record)
    _log_contacts(branch, record)


def _pose_samples(record: EpisodeRecord) -> tuple[Array, Array, Array, Array]:
    """Return time, joint angles, cube position and quaternion at about 50 Hz, or at 10 Hz without a trace."""
    if not record.trace:
        return record.time, record.joint_position, record.cube_position, record.cube_quaternion
    time = record.trace["time"]
    stride = max(1, round(1.0 / (POSE_RATE * float(time[1] - time[0]))))
    names = ("time", "q", "cube_position", "cube_quaternion")
    fine, q, position, quaternion = (record.trace[name][::stride] for name in names)
    return fine, q, position, quaternion


def _log_object(branch: Branch, record: EpisodeRecord) -> None:
    """Write the object as this episode has it, one colour a face; its size may differ between episodes."""
    normals = np.array(list(FACE_NORMALS.values()), dtype=np.float64)
    half = record.cube_size / 2
    stickers = np.where(np.abs(normals) == 1, STICKER_HEIGHT, STICKER * half)
    frame, colours = half, [tuple(round(255 * part) for part in colour) for colour in FACE_COLOURS.values()]
    if isinstance(record.object_shape, ObjectMesh):
        _log_mesh(branch, record.object_shape, record.cube_size)
        return
    if record.object_shape != "box":
        _log_round_body(branch, record)
        stripes = np.abs(normals[:, :2]).sum(axis=1) == 1
        stickers = np.where(np.abs(normals) == 1, 0.03 * half[0], (0.1, 0.1, 0.4) * half) * stripes[:, None]
        frame = np.zeros(3)
    boxes = rr.Boxes3D(
        centers=np.vstack([np.zeros((1, 3)), normals * half]),
        half_sizes=np.vstack([frame[None], stickers]),
        colors=[(40, 40, 40), *colours],
        fill_mode="solid",
    )
    branch.log("cube", boxes)


def _log_mesh(branch: Branch, mesh: ObjectMesh, size: Array) -> None:
    """Write a mesh's faces, coloured by where they look, so that one sees how it is turned."""
    corners = (mesh.vertices * size)[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sides = np.argmax(normals @ np.array(list(FACE_NORMALS.values()), dtype=np.float64).T, axis=1)
    palette = np.round(255 * np.array(list(FACE_COLOURS.values()))).astype(np.uint8)
    body = rr.Mesh3D(
        vertex_positions=corners.reshape(-1, 3),
        triangle_indices=np.arange(corners.size // 3).reshape(-1, 3),
        vertex_colors=np.repeat(palette[sides], 3, axis=0),
    )
    branch.log("cube/body", body)


def _log_round_body(branch: Branch, record: EpisodeRecord) -> None:
    """Write a round object's body; the stripes on it tell how it is turned."""
    radius = 0.5 * float(record.cube_size[0])
    capsule = record.object_shape == "capsule"
    length = float(record.cube_size[2]) - (2.0 * radius if capsule else 0.0)
    look: dict[str, Any] = {"colors": [(90, 90, 96)], "fill_mode": "solid"}
    branch.log("cube/body", rr.Cylinders3D(lengths=[length], radii=[radius], **look))
    if capsule:
        ends = [[0.0, 0.0, 0.5 * length], [0.0, 0.0, -0.5 * length]]
        branch.log("cube/ends", rr.Ellipsoids3D(centers=ends, half_sizes=[[radius] * 3] * 2, **look))


def _log_trail(branch: Branch, record: EpisodeRecord) -> None:
    """Write the way of one upper corner of the cube: its turning about the vertical and its creeping in one line."""
    corners = record.cube_position + Rotation.from_quat(record.cube_quaternion).apply(0.5 * record.cube_size)
    for sample, time in enumerate(record.time.tolist()):
        way = corners[max(0, sample - TRAIL) : sample + 1]
        branch.log("trail", rr.LineStrips3D([way], colors=[(225, 180, 0)], radii=0.0008), time)


def _log_contacts(branch: Branch, record: EpisodeRecord) -> None:
    """Write the contact forces on the cube as arrows, all fingers in their colour, at the policy's rate."""
    table = record.contacts
    for sample, time in enumerate(record.time.tolist()):
        rows = (table.step == sample) & (table.normal_force > TOUCH_FORCE)
        # The arrow ends where the finger pushes: it stands outside the cube and can be seen.
        vectors = ARROW_LENGTH * table.force[rows]
        arrows = rr.Arrows3D(
            origins=table.position[rows] - vectors,
            vectors=vectors,
            colors=[FINGER_COLOURS[finger % len(FINGER_COLOURS)] for finger in table.finger[rows].tolist()],
            radii=0.0018,
        )
        branch.log("contacts", arrows, time)
