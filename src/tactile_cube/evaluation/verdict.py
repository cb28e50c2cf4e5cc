"""Verdict on each episode: its class, the numbers that decide it, and physically wrong turning."""

from dataclasses import asdict, dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.env.reward import SUPPORTING_TIPS, TOUCH_FORCE
from tactile_cube.evaluation.episode_record import Array, EpisodeRecord

REGRASP_ANGLE = 2.0
"""Final angle beyond which four fingers that never let go cannot have turned the cube [rad].

Source: all four tips in contact reach about -49..+52 deg of yaw (1.76 rad from end to end), measured on this hand.
"""
STILL_ANGLE = 0.5  # below this final angle the cube counts as held, not turned [rad]
REGRASP_FACE_CHANGES = 2  # moves of a finger to another side face that a regrasping episode shows at least
LATE_SHARE, LATE_ANGLE = 0.4, 0.25
"""The last part of an episode, and the angle that must be gained in it [rad]: less means that the hand stagnates."""
SUCCESS_RATE = 15.0 / 40.0
"""Lowest mean speed at which an episode that keeps the object to the end is a success [rad/s].

15 rad in 40 s is the paper's best run (section IV). It depends on no other episode, whatever their length.
"""
SUCCESS = "kept to the end and turned by at least 15 rad in 40 s, in proportion for other lengths"  # the rule in words
MAX_ANGLE_MISMATCH = 0.3
"""Largest difference between the reported angle and the integrated rotation about the task's axis [rad]."""
CONE = 0.06
"""Share of the angle that may differ besides: the axis of a cube tilted by up to 20 deg goes around a cone as it turns,
whose solid angle 1 - cos(20 deg) a turn is in the integrated rotation and not in the angle."""
MAX_FREE_SPIN_SHARE = 0.2  # largest share of the final angle that may be gained while nothing holds the cube
MAX_TILT = 0.8  # largest tilt of the cube's z axis [rad]; the training episode ends there too
MAX_PENETRATION = 0.006  # deepest overlap of a finger and the cube [m]; a firm grasp of 10 N overlaps by less than 1 mm
MAX_STEP_ANGLE = np.pi / 4
"""Largest turn within one policy step [rad]: beyond it a quarter turn of the symmetric cube could hide."""
FACES = ("+x", "-x", "+y", "-y", "+z", "-z")


class EpisodeVerdict(StrEnum):
    """Class of an episode.

    - `regrasping`: kept the cube, turned it beyond `REGRASP_ANGLE` and was still turning it at the end (`LATE_ANGLE`),
      and fingers moved to new faces at least `REGRASP_FACE_CHANGES` times.
    - `holding`: kept the cube and turned it by less than `STILL_ANGLE`.
    - `stuck_twisted`: kept the cube, turned it and came to rest, or never regrasped: the paper's failure (a). With
      a wide range of start yaws one long twist can exceed `REGRASP_ANGLE`; coming to rest gives it away.
    - `spun_and_dropped`: lost the cube after turning it by more than `STILL_ANGLE` without regrasping: failure (c).
    - `dropped`: lost the cube in any other way, be it before turning it or after regrasps.
    """

    REGRASPING = "regrasping"
    HOLDING = "holding"
    STUCK_TWISTED = "stuck_twisted"
    SPUN_AND_DROPPED = "spun_and_dropped"
    DROPPED = "dropped"


@dataclass(frozen=True)
class EpisodeResult:
    """The row of one episode in the results table.

    Attributes:
        episode: its number.
        seed: what its start, noise and randomisation were drawn from.
        final_angle: theta at the end, less theta at the start [rad].
        late_angle: the part of it gained in the last `LATE_SHARE` of the episode [rad].
        duration: time until the end [s].
        ending: why it ended.
        verdict: what it was.
        finger_lifts: how often each finger let go and touched again, ring to thumb.
        face_changes: how often each finger moved to another side face, ring to thumb.
        faces_visited: different side faces each finger has stood on, ring to thumb.
        max_tilt: largest tilt of the cube [rad].
        rise: mean height of the cube above its start in the last `LATE_SHARE` of the episode [m].
        drift: mean vertical velocity of the cube, below 0 where it sinks [m/s].
        tip_support: as `link_contact` and `link_force_share`: see `touch.support`.
        reward_terms: sum of each weighted term of the reward.
        exploits: names of physical exploits found; empty when the turning is honest.
        world: constants of its world, SI units, as `EpisodeRecord.constants` has them.
    """

    episode: int
    seed: int
    final_angle: float
    late_angle: float
    duration: float
    ending: str
    verdict: EpisodeVerdict
    finger_lifts: tuple[int, ...]
    face_changes: tuple[int, ...]
    faces_visited: tuple[int, ...]
    max_tilt: float
    rise: float
    drift: float
    tip_support: float
    link_contact: float
    link_force_share: float
    reward_terms: dict[str, float]
    exploits: tuple[str, ...]
    world: dict[str, float | str]

    @property
    def kept(self) -> bool:
        """Whether the cube was still in the hand at the end."""
        return self.ending == "time_limit"

    @property
    def success(self) -> bool:
        """Whether it kept the cube and turned it at least as fast as `SUCCESS_RATE`, in the rewarded direction."""
        return self.kept and self.final_angle >= SUCCESS_RATE * self.duration

    def as_dict(self) -> dict[str, object]:
        """Return plain data for JSON."""
        return {**asdict(self), "kept": self.kept, "success": self.success}


def judge_episode(record: EpisodeRecord, episode: int = 0, seed: int = 0) -> EpisodeResult:
    """Return the row of an episode in the results table."""
    histories = [finger_history(record, finger) for finger in range(len(record.fingers))]
    angle = float(record.theta[-1] - record.theta[0])
    begin, duration = round((1.0 - LATE_SHARE) * record.steps), float(record.time[-1] - record.time[0])
    late, height = (
        float(record.theta[-1] - record.theta[begin]),
        record.cube_position[:, 2] - record.cube_position[0, 2],
    )
    changes = tuple(history.face_changes for history in histories)
    return EpisodeResult(
        episode=episode,
        seed=seed,
        final_angle=angle,
        late_angle=late,
        duration=duration,
        ending=record.ending,
        verdict=verdict(angle, late, sum(changes), lost=record.cut_short),
        finger_lifts=tuple(history.lifts for history in histories),
        face_changes=changes,
        faces_visited=tuple(len(set(history.faces)) for history in histories),
        max_tilt=float(np.max(cube_tilt(record))),
        rise=float(np.mean(height[begin:])),
        drift=float(height[-1]) / max(duration, 1e-9),
        **support(record),
        reward_terms={name: float(np.sum(term)) for name, term in record.reward_terms.items()},
        exploits=tuple(exploits(record)),
        world=dict(record.constants),
    )


def verdict(final_angle: float, late_angle: float, face_changes: int, *, lost: bool) -> EpisodeVerdict:
    """Apply the definitions of `EpisodeVerdict`."""
    regrasped = face_changes >= REGRASP_FACE_CHANGES
    if lost:
        twisted = final_angle > STILL_ANGLE and not regrasped
        return EpisodeVerdict.SPUN_AND_DROPPED if twisted else EpisodeVerdict.DROPPED
    if final_angle > REGRASP_ANGLE and late_angle > LATE_ANGLE and regrasped:
        return EpisodeVerdict.REGRASPING
    return EpisodeVerdict.HOLDING if final_angle < STILL_ANGLE else EpisodeVerdict.STUCK_TWISTED


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
    """Measure what supports the cube at the ends of policy steps; a touch exceeds `TOUCH_FORCE` on a tip, or on links.

    Returns:
        tip_support: share of the time in which `SUPPORTING_TIPS` fingertips or more touch it. link_contact: share of
        the time in which a link touches it that is no fingertip. link_force_share: these links' share of all normal
        force of the fingers; 0 without any force.
    """
    table = record.contacts
    force = np.zeros((2, record.steps + 1, len(record.fingers)))
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
    scaled = orientation.inv().apply(table.position - record.cube_position[table.step]) / (record.cube_size / 2)
    axis = np.argmax(np.abs(scaled), axis=1)
    return np.asarray(2 * axis + (scaled[np.arange(len(axis)), axis] < 0), dtype=np.int64)


def finger_history(record: EpisodeRecord, finger: int) -> FingerHistory:
    """Follow one finger through the episode; an edge touches two faces, so a face must hold for two samples."""
    contact, table = touching(record)[:, finger], record.contacts
    landed = np.flatnonzero(contact[1:] & ~contact[:-1]) + 1
    mine = (table.finger == finger) & (table.normal_force > TOUCH_FORCE)
    touched: dict[int, set[int]] = {}
    for step, face in zip(table.step[mine].tolist(), touched_faces(record)[mine].tolist(), strict=True):
        if face < 4:
            touched.setdefault(step, set()).add(face)
    sequence: list[int] = []
    for step in sorted(touched):
        settled = touched[step] & touched.get(step + 1, set())
        if len(settled) == 1 and settled != {*sequence[-1:]}:
            sequence.extend(settled)
    lifts = sum(bool(contact[:sample].any()) for sample in landed)
    return FingerHistory(lifts, tuple(FACES[face] for face in sequence))


def cube_tilt(record: EpisodeRecord) -> Array:
    """Return the angle between the rotation's axis in the cube and in the world `(n + 1,)` [rad]."""
    axis = Rotation.from_quat(record.cube_quaternion).apply(record.axis)
    return np.asarray(np.arccos(np.clip(axis @ np.array(record.axis), -1.0, 1.0)), dtype=np.float64)


def integrated_rotation(record: EpisodeRecord) -> Array:
    """Return the turn about the task's axis from increments of the quaternion `(n + 1,)` [rad].

    It does not depend on Euler angles or on how the environment unwraps theta.
    """
    orientation = Rotation.from_quat(record.cube_quaternion)
    increments = (orientation[1:] * orientation[:-1].inv()).as_rotvec() @ np.array(record.axis)
    return record.direction * np.concatenate([[0.0], np.cumsum(increments)])


def free_spin(record: EpisodeRecord) -> float:
    """Return the angle gained in steps that begin and end with a cube that nothing holds [rad].

    In the air it takes two fingers to hold it; on a table or in a palm one is enough to push it around.
    """
    lies = not {"table_height", "palm_contact"}.isdisjoint(record.constants)
    loose = touching(record).sum(axis=1) < (1 if lies else 2)
    return float(np.sum(np.maximum(np.diff(record.theta)[loose[1:] & loose[:-1]], 0.0)))


def exploits(record: EpisodeRecord) -> list[str]:
    """Return the names of what is physically wrong with an episode."""
    gained = float(record.theta[-1] - record.theta[0])
    found = {
        "angle_mismatch": abs(gained - integrated_rotation(record)[-1]) > MAX_ANGLE_MISMATCH + CONE * abs(gained),
        "angle_jump": np.max(np.abs(np.diff(record.theta)), initial=0.0) > MAX_STEP_ANGLE,
        "flung": gained > 0.5 and free_spin(record) > MAX_FREE_SPIN_SHARE * gained,
        # A cube that falls may tumble as it goes: the tilt counts only while it is held.
        "tumbled": not record.cut_short and np.max(cube_tilt(record)) > MAX_TILT,
        "penetration": np.min(record.contacts.distance, initial=0.0) < -MAX_PENETRATION,
    }
    return [name for name, wrong in found.items() if wrong]
