"""An episode as a Rerun recording: hand, cube and contacts in 3D, the task at 10 Hz, the joints at 500 Hz."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
from rerun.urdf import UrdfTree
from scipy.spatial.transform import Rotation

from tactile_cube.evaluation.episode_record import Array, EpisodeRecord
from tactile_cube.evaluation.touch import TOUCH_FORCE
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.visualization.blueprint import TIMELINE, episode_blueprint
from tactile_cube.visualization.scene import FACE_COLOURS, FACE_NORMALS, STICKER, STICKER_HEIGHT
from tactile_cube.visualization.solid_links import fill_shapes

ARROW_LENGTH = 0.03
"""Length of a contact arrow [m/N]."""
POSE_RATE = 50.0
"""Rate of the 3D poses [Hz]: smooth to the eye; the joint signals keep the physics rate."""
FINGER_COLOURS = ((214, 69, 65), (245, 171, 53), (38, 166, 91), (65, 131, 215), (150, 90, 200), (90, 190, 200))
SIGNALS = {"q": 1.0, "q_m": 0.75, "q_f": 0.6, "q_d": 0.45, "torque": 1.0}
"""Signals at the physics rate, and how bright their lines are."""
TRAIL = 50
"""Policy steps for which the way of the cube's corner stays visible: 5 s."""
JOINT_COLOURS = ((235, 90, 80), (110, 200, 110), (110, 150, 255), (240, 190, 80), (190, 120, 230), (130, 210, 220))


def write_recording(record: EpisodeRecord, path: Path, hand: Hand = DLR_HAND2, summary: str = "") -> None:
    """Write one episode with its blueprint; open it with `rerun FILE.rrd`.

    Args:
        record: the episode.
        path: file to write, `.rrd`.
        hand: the hand that acted.
        summary: Markdown shown beside the episode.
    """
    stream = rr.RecordingStream("tactile_cube", recording_id=path.stem)
    stream.save(path, default_blueprint=episode_blueprint(record.fingers, hand.name))
    _log_hand(stream, record, hand)
    _log_cube(stream, record)
    _log_trail(stream, record)
    _log_contacts(stream, record)
    _log_task(stream, record)
    _log_joints(stream, record)
    _log_readings(stream, record)
    stream.log(
        "episode", rr.TextDocument(summary or f"ended: {record.ending}", media_type="text/markdown"), static=True
    )
    stream.flush()
    stream.disconnect()


def _pose_samples(record: EpisodeRecord) -> tuple[Array, Array, Array, Array]:
    """Return time, joint angles, cube position and quaternion at about 50 Hz, or at 10 Hz without a trace."""
    if not record.trace:
        return record.time, record.joint_position, record.cube_position, record.cube_quaternion
    time = record.trace["time"]
    stride = max(1, round(1.0 / (POSE_RATE * float(time[1] - time[0]))))
    names = ("time", "q", "cube_position", "cube_quaternion")
    fine, q, position, quaternion = (record.trace[name][::stride] for name in names)
    return fine, q, position, quaternion


def _at(time: Array) -> list[rr.TimeColumn]:
    return [rr.TimeColumn(TIMELINE, duration=time)]


def _log_hand(stream: rr.RecordingStream, record: EpisodeRecord, hand: Hand) -> None:
    """Log the URDF once and each joint's transform over time, the coupled joint with the angle of its neighbour."""
    urdf = hand.urdf()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "hand.urdf"
        file.write_text(urdf, encoding="utf-8")
        tree = UrdfTree.from_file_path(file, entity_path_prefix="hand", static_transform_entity_path="hand/static")
        tree.log_urdf_to_recording(stream)
    fill_shapes(stream, tree, urdf)
    orientation = Rotation.from_matrix(hand.rotation).as_quat()
    root = rr.Transform3D(
        translation=hand.position,
        quaternion=rr.Quaternion(xyzw=orientation),
        parent_frame="tf#/",
        child_frame=tree.root_link().name,
    )
    stream.log("hand/pose", root, static=True)
    time, q, _, _ = _pose_samples(record)
    columns = {name: index for index, name in enumerate(hand.joint_names)}
    for joint in tree.joints():
        actuated = hand.followed(joint.name)
        if actuated in columns:
            transform = joint.compute_transform_columns(q[:, columns[actuated]].tolist(), clamp=False)
            stream.send_columns(f"hand/joint_transforms/{joint.name}", _at(time), transform)


def _log_round_body(stream: rr.RecordingStream, record: EpisodeRecord) -> None:
    """Log a round object's body; the stripes on it tell how it is turned."""
    radius = 0.5 * float(record.cube_size[0])
    capsule = record.object_shape == "capsule"
    length = float(record.cube_size[2]) - (2.0 * radius if capsule else 0.0)
    grey = [(90, 90, 96)]
    look: dict[str, Any] = {"colors": grey, "fill_mode": "solid"}
    stream.log("cube/body", rr.Cylinders3D(lengths=[length], radii=[radius], **look), static=True)
    if capsule:
        ends = [[0.0, 0.0, 0.5 * length], [0.0, 0.0, -0.5 * length]]
        stream.log("cube/ends", rr.Ellipsoids3D(centers=ends, half_sizes=[[radius] * 3] * 2, **look), static=True)


def _log_cube(stream: rr.RecordingStream, record: EpisodeRecord) -> None:
    """Log the cube with one colour a face, and its pose over time."""
    normals = np.array(list(FACE_NORMALS.values()), dtype=np.float64)
    half = record.cube_size / 2
    stickers = np.where(np.abs(normals) == 1, STICKER_HEIGHT, STICKER * half)
    frame, colours = half, [tuple(round(255 * part) for part in colour) for colour in FACE_COLOURS.values()]
    if record.object_shape != "box":
        _log_round_body(stream, record)
        stripes = np.abs(normals[:, :2]).sum(axis=1) == 1
        stickers = np.where(np.abs(normals) == 1, 0.03 * half[0], (0.1, 0.1, 0.4) * half) * stripes[:, None]
        frame = np.zeros(3)
    boxes = rr.Boxes3D(
        centers=np.vstack([np.zeros((1, 3)), normals * half]),
        half_sizes=np.vstack([frame[None], stickers]),
        colors=[(40, 40, 40), *colours],
        fill_mode="solid",
    )
    stream.log("cube", boxes, static=True)
    time, _, position, quaternion = _pose_samples(record)
    stream.send_columns("cube", _at(time), rr.Transform3D.columns(translation=position, quaternion=quaternion))


def _log_trail(stream: rr.RecordingStream, record: EpisodeRecord) -> None:
    """Log the way of one upper corner of the cube: its turning about the vertical and its creeping show in one line."""
    corners = record.cube_position + Rotation.from_quat(record.cube_quaternion).apply(0.5 * record.cube_size)
    for sample, time in enumerate(record.time.tolist()):
        stream.set_time(TIMELINE, duration=time)
        way = corners[max(0, sample - TRAIL) : sample + 1]
        stream.log("trail", rr.LineStrips3D([way], colors=[(250, 220, 80)], radii=0.0008))
    stream.reset_time()


def _log_contacts(stream: rr.RecordingStream, record: EpisodeRecord) -> None:
    """Log the contact forces on the cube as arrows, all fingers in their colour, at the policy's rate."""
    table = record.contacts
    for sample, time in enumerate(record.time.tolist()):
        rows = (table.step == sample) & (table.normal_force > TOUCH_FORCE)
        stream.set_time(TIMELINE, duration=time)
        # The arrow ends where the finger pushes: it stands outside the cube and can be seen.
        vectors = ARROW_LENGTH * table.force[rows]
        arrows = rr.Arrows3D(
            origins=table.position[rows] - vectors,
            vectors=vectors,
            colors=[FINGER_COLOURS[finger % len(FINGER_COLOURS)] for finger in table.finger[rows].tolist()],
            radii=0.0012,
        )
        stream.log("contacts", arrows)
    stream.reset_time()


def _log_task(stream: rr.RecordingStream, record: EpisodeRecord) -> None:
    _send(stream, "task/theta", record.time, record.theta, ["theta"])
    forces = np.zeros((record.steps + 1, len(record.fingers)))
    np.add.at(forces, (record.contacts.step, record.contacts.finger), record.contacts.normal_force)
    _send(stream, "task/force", record.time, forces, list(record.fingers), FINGER_COLOURS[: len(record.fingers)])
    for name, values in record.reward_terms.items():
        _send(stream, f"task/reward/{name}", record.time[1:], values, [name])
    _send(stream, "task/reward/sum", record.time[1:], record.reward, ["sum"])
    for name, value in record.constants.items():
        if name in ("filter_time", "gravity_scale"):
            _send(stream, f"curriculum/{name}", record.time, np.full(record.steps + 1, value), [name])


def _log_joints(stream: rr.RecordingStream, record: EpisodeRecord) -> None:
    """Send the joint signals of each finger at the physics rate in one piece each."""
    for index, finger in enumerate(record.fingers):
        mine = record.of_finger(index)
        entity = f"joints/{finger}"
        for signal, brightness in SIGNALS.items():
            if signal in record.trace:
                colours = [tuple(round(brightness * part) for part in colour) for colour in JOINT_COLOURS]
                _send_joints(
                    stream, f"{entity}/{signal}", record.trace["time"], record.trace[signal][:, mine], signal, colours
                )
        _send_joints(stream, f"{entity}/q_n", record.time[:-1], record.target[:, mine], "q_n")


def _log_readings(stream: rr.RecordingStream, record: EpisodeRecord) -> None:
    """Send what the policy gets of each finger, q_m and e_q = q_f - q_m at 10 Hz, before the sensors' noise."""
    if not {"q_m", "q_f"} <= set(record.trace):
        return
    time = record.trace["time"]
    stride = len(time) // record.steps
    last = np.maximum(stride * np.arange(record.steps) - 1, 0)  # the physics step that ends where the policy is asked
    q_m = record.trace["q_m"][last]
    e_q = record.trace["q_f"][last] - q_m
    for index, finger in enumerate(record.fingers):
        mine = record.of_finger(index)
        for name, values in (("q_m", q_m), ("e_q", e_q)):
            entity = f"policy/{finger}/{name}"
            _send_joints(stream, entity, record.time[:-1], values[:, mine], name, JOINT_COLOURS)


def _send_joints(
    stream: rr.RecordingStream,
    entity: str,
    time: Array,
    values: Array,
    signal: str,
    colours: Sequence[tuple[int, ...]] | None = None,
) -> None:
    """A signal (n, joints) of one finger; colours go round where it has more joints than there are."""
    count = values.shape[1]
    painted = None if colours is None else [colours[joint % len(colours)] for joint in range(count)]
    _send(stream, entity, time, values, [f"{signal}, joint {joint + 1}" for joint in range(count)], painted)


def _send(
    stream: rr.RecordingStream,
    entity: str,
    time: Array,
    values: Array,
    names: list[str],
    colours: Sequence[tuple[int, ...]] | None = None,
) -> None:
    stream.log(entity, rr.SeriesLines(names=names, colors=colours), static=True)
    stream.send_columns(entity, _at(time), rr.Scalars.columns(scalars=values))
