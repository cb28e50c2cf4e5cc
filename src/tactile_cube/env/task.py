"""The task: pose of the cube, where it may go, how heavy it is, how long an episode lasts."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.simulation import EpisodeConstants


class CubePose(NamedTuple):
    """Pose of the cube in the world.

    Attributes:
        x: position of the centre [m].
        y: position of the centre [m].
        z: position of the centre [m].
        theta: angle about the vertical z axis, unwrapped [rad].
        phi: rotation about the y axis [rad].
        psi: rotation about the x axis [rad].
        tilt: angle between the cube's z axis and the vertical [rad].
    """

    x: float
    y: float
    z: float
    theta: float
    phi: float
    psi: float
    tilt: float


def frame_along(axis: Sequence[float] | NDArray[np.float64]) -> Rotation | None:
    """Return the frame whose z axis is a direction of the world (3,); None for the vertical, the world's own z axis."""
    if np.array_equal(axis, (0.0, 0.0, 1.0)):
        return None
    return Rotation.align_vectors([axis], [(0.0, 0.0, 1.0)])[0]


def seen_along(frame: Rotation | None, quaternion: Sequence[float]) -> Sequence[float]:
    """Express an orientation (4,) x, y, z, w of the world in `frame`: rotation about its z axis changes theta."""
    if frame is None:
        return quaternion
    turned = frame.inv() * Rotation.from_quat(quaternion) * frame
    return [float(part) for part in turned.as_quat()]


def cube_pose(position: Sequence[float], quaternion: Sequence[float], previous_theta: float | None = None) -> CubePose:
    """Return the pose from a position (3,) [m] and a quaternion (4,) x, y, z, w.

    The rotation is taken apart as Rz(theta) Ry(phi) Rx(psi). Given the theta of the previous step, theta is unwrapped:
    of all angles that differ by whole turns it is the nearest one, right while the cube turns less than half a turn a
    step.
    """
    x, y, z, w = quaternion
    theta = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    if previous_theta is not None:
        theta = previous_theta + math.remainder(theta - previous_theta, 2.0 * math.pi)
    phi = math.asin(min(1.0, max(-1.0, 2.0 * (w * y - z * x))))
    upright = 1.0 - 2.0 * (x * x + y * y)
    psi = math.atan2(2.0 * (w * x + y * z), upright)
    tilt = math.acos(min(1.0, max(-1.0, upright)))
    return CubePose(position[0], position[1], position[2], theta, phi, psi, tilt)


@dataclass(frozen=True)
class Conditions:
    """Conditions that an episode starts with and keeps to its end.

    Attributes:
        filter_time: T_s, time constant of the low-pass that turns q_n into q_f [s].
        gravity_scale: part of the cube's weight that acts.
        penalty_scale: factor on the weights of height, plane and tilt.
    """

    filter_time: float
    gravity_scale: float
    penalty_scale: float

    def columns(self) -> dict[str, float]:
        """Return the conditions by their names in logs: "T_s" [s], "gravity" and "penalty" (scales)."""
        return {"T_s": self.filter_time, "gravity": self.gravity_scale, "penalty": self.penalty_scale}


OUTCOMES = ("running", "time_limit", "dropped", "left_range", "tilted", "lifted", "faulty")
"""What an episode's step can lead to; the key "outcome" is an index into it."""

LONGEST = 1_000_000  # policy steps of an episode: more than a day
RUNNING, TIME_LIMIT, DROPPED, LEFT_RANGE, TILTED, LIFTED, FAULTY = range(len(OUTCOMES))
LOST = frozenset((DROPPED, LEFT_RANGE, TILTED, LIFTED))  # outcomes of a cube that left the allowed range


@dataclass(frozen=True)
class Task:
    """Rotate the object about an axis of the world, the vertical by default, without losing it.

    Attributes:
        name: "table", "float" or "full"; only a label.
        filter_time: T_s [s].
        gravity_scale: part of the cube's weight that acts; float has 0.05. Source: paper, table I.
        table: whether the cube sits on a table.
        episode_steps: policy steps until the time limit; 100 first, 200 when fine-tuning. Source: website.
        direction: sense about +z that is rewarded, +1 or -1.
        gravity_onset: policy steps at the start in which the cube is weightless. Source: website (less than 0.5 s).
        plane_range: distance from the start in x and y that ends the episode [m] (size not published).
        height_range: distance from the start in z that ends the episode [m] (size not published).
        tilt_limit: angle between the cube's z axis and the vertical that ends the episode [rad]; keeps theta defined.
        symmetry: of the object about the axis: critics see its angle up to 1 / symmetry of a turn. Source: paper.
        axis: x, y, z or a direction of the world (3,). theta, phi, psi and the tilt are then told from this axis as
            from the vertical; heights and the allowed range stay where gravity has them.
    """

    name: str
    filter_time: float = 0.5
    gravity_scale: float = 1.0
    table: bool = False
    episode_steps: int = 100
    direction: int = -1
    gravity_onset: int = 4
    plane_range: float = 0.035
    height_range: float = 0.04
    tilt_limit: float = 0.8
    symmetry: int = 4
    axis: str | Sequence[float] = "z"

    def __post_init__(self) -> None:
        """Refuse values without a meaning."""
        for key in ("filter_time", "plane_range", "height_range", "tilt_limit", "episode_steps", "symmetry"):
            value = getattr(self, key)
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"task.{key} is {value}; give a number above 0")
        if self.episode_steps > LONGEST:
            raise InputError(f"task.episode_steps is {self.episode_steps}; give at most {LONGEST}")
        for key in ("gravity_scale", "gravity_onset"):
            if not getattr(self, key) >= 0:
                raise InputError(f"task.{key} is {getattr(self, key)}; give a number >= 0")
        if self.direction not in (1, -1):
            raise InputError(f"task.direction is {self.direction}; give +1 or -1")
        self.axis_vector()  # refuses what is no direction

    def axis_vector(self) -> NDArray[np.float64]:
        """Return the axis of the rotation as a unit vector (3,)."""
        named = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
        given = named.get(self.axis, ()) if isinstance(self.axis, str) else self.axis
        vector = np.asarray(given, dtype=np.float64)
        length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
        if not (math.isfinite(length) and length > 0.0):
            raise InputError(f"task.axis is {self.axis}; give x, y, z or three numbers that are not all zero")
        return np.asarray(vector / length)

    def conditions(self) -> Conditions:
        """Return the task's own conditions, at which a curriculum ends."""
        return Conditions(self.filter_time, self.gravity_scale, penalty_scale=1.0)

    def apply(self, constants: EpisodeConstants, conditions: Conditions) -> EpisodeConstants:
        """Return the constants of an episode: T_s and weight of `conditions`, gravity onset and table of this task."""
        return dataclasses.replace(
            constants,
            filter_time=conditions.filter_time,
            gravity_scale=conditions.gravity_scale,
            gravity_onset=self.gravity_onset,
            table_height=-0.5 * float(np.asarray(constants.cube_size)[2]) if self.table else None,
        )

    def outcome(self, start: CubePose, now: CubePose, step: int) -> int:
        """Return the index into OUTCOMES of a cube at `now`, `step` policy steps after it began at `start`."""
        if now.z - start.z < -self.height_range:
            return DROPPED
        if max(abs(now.x - start.x), abs(now.y - start.y)) > self.plane_range:
            return LEFT_RANGE
        if now.tilt > self.tilt_limit:
            return TILTED
        if now.z - start.z > self.height_range:
            return LIFTED
        return TIME_LIMIT if step >= self.episode_steps else RUNNING
