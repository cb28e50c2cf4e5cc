"""Which finger touched which face of the cube, when it let go, where it landed again, and what bore the cube."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.env.reward import SUPPORTING_TIPS, TOUCH_FORCE
from tactile_cube.evaluation.episode_record import EpisodeRecord

FACES = ("+x", "-x", "+y", "-y", "+z", "-z")


@dataclass(frozen=True)
class FingerHistory:
    """How often a finger let go and touched again later, and the side faces it landed on, in their order."""

    lifts: int
    faces: tuple[str, ...]

    @property
    def face_changes(self) -> int:
        """How often it moved to another side face: what a regrasp is."""
        return max(len(self.faces) - 1, 0)


def touching(record: EpisodeRecord) -> NDArray[np.bool_]:
    """Return which finger touches the cube at each sample `(n + 1, fingers)`."""
    table = record.contacts
    result = np.zeros((record.steps + 1, len(record.fingers)), dtype=bool)
    firm = table.normal_force > TOUCH_FORCE
    result[table.step[firm], table.finger[firm]] = True
    return result


def support(record: EpisodeRecord) -> dict[str, float]:
    """What bears the cube at the ends of the policy steps; a touch is more than `TOUCH_FORCE` of a tip, or of links.

    Returns:
        tip_support: share of the time in which `SUPPORTING_TIPS` fingertips or more touch it. link_contact: share of
        the time in which a link touches it that is no fingertip. link_force_share: these links' share of all normal
        force of the fingers; 0 without any force.
    """
    table, fingers = record.contacts, len(record.fingers)
    force = np.zeros((2, record.steps + 1, fingers))
    np.add.at(force, (table.tip.astype(np.int64), table.step, table.finger), table.normal_force)
    links, tips = force[:, 1:]  # without the start, where no force has acted yet
    total = float(links.sum() + tips.sum())
    return {
        "tip_support": float(((tips > TOUCH_FORCE).sum(axis=1) >= SUPPORTING_TIPS).mean()),
        "link_contact": float((links > TOUCH_FORCE).any(axis=1).mean()),
        "link_force_share": float(links.sum()) / total if total > 0.0 else 0.0,
    }


def touched_faces(record: EpisodeRecord) -> NDArray[np.int64]:
    """Return the face of each contact row `(k,)`: an index into `FACES`, in the cube's own frame."""
    table = record.contacts
    if not len(table.step):
        return np.zeros(0, dtype=np.int64)
    orientation = Rotation.from_quat(record.cube_quaternion[table.step])
    local = orientation.inv().apply(table.position - record.cube_position[table.step])
    scaled = local / (record.cube_size / 2)
    axis = np.argmax(np.abs(scaled), axis=1)
    negative = scaled[np.arange(len(axis)), axis] < 0
    return np.asarray(2 * axis + negative, dtype=np.int64)


def finger_history(record: EpisodeRecord, finger: int) -> FingerHistory:
    """Follow one finger through the episode."""
    contact = touching(record)[:, finger]
    landed = np.flatnonzero(contact[1:] & ~contact[:-1]) + 1
    lifts = sum(1 for sample in landed if contact[:sample].any())
    table = record.contacts
    mine = (table.finger == finger) & (table.normal_force > TOUCH_FORCE)
    return FingerHistory(int(lifts), _face_sequence(table.step[mine], touched_faces(record)[mine]))


def _face_sequence(steps: NDArray[np.int64], faces: NDArray[np.int64]) -> tuple[str, ...]:
    """Return side faces in order of landing; an edge touches two faces at once, so a face must hold for two samples."""
    per_step: dict[int, set[int]] = {}
    for step, face in zip(steps.tolist(), faces.tolist(), strict=True):
        if face < 4:
            per_step.setdefault(step, set()).add(face)
    sequence: list[int] = []
    for step in sorted(per_step):
        settled = per_step[step] & per_step.get(step + 1, set())
        if len(settled) == 1 and (not sequence or settled != {sequence[-1]}):
            sequence.extend(settled)
    return tuple(FACES[face] for face in sequence)
