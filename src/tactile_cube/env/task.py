"""The task: where the cube may go, how heavy it is, how long an episode lasts."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.env.cube_pose import CubePose
from tactile_cube.errors import InputError
from tactile_cube.simulation import EpisodeConstants


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
        """By the names that they have in logs: "T_s" [s], "gravity" and "penalty" (scales)."""
        return {"T_s": self.filter_time, "gravity": self.gravity_scale, "penalty": self.penalty_scale}


OUTCOMES = ("running", "time_limit", "dropped", "left_range", "tilted", "lifted", "faulty")
"""What an episode's step can lead to; the key "outcome" is an index into it."""

LONGEST = 1_000_000
"""Policy steps of an episode: more than a day."""
RUNNING, TIME_LIMIT, DROPPED, LEFT_RANGE, TILTED, LIFTED, FAULTY = range(len(OUTCOMES))


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
        """Refuses values without a meaning."""
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
        """The axis of the rotation as a unit vector (3,)."""
        named = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
        given = named.get(self.axis, ()) if isinstance(self.axis, str) else self.axis
        vector = np.asarray(given, dtype=np.float64)
        length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
        if not (math.isfinite(length) and length > 0.0):
            raise InputError(f"task.axis is {self.axis}; give x, y, z or three numbers that are not all zero")
        return np.asarray(vector / length)

    def conditions(self) -> Conditions:
        """The task's own conditions, which a curriculum ends at."""
        return Conditions(self.filter_time, self.gravity_scale, penalty_scale=1.0)

    def apply(self, constants: EpisodeConstants, conditions: Conditions) -> EpisodeConstants:
        """The constants of an episode of this task: T_s, weight, onset of gravity and table as the task wants them."""
        return dataclasses.replace(
            constants,
            filter_time=conditions.filter_time,
            gravity_scale=conditions.gravity_scale,
            gravity_onset=self.gravity_onset,
            table_height=-0.5 * float(np.asarray(constants.cube_size)[2]) if self.table else None,
        )

    def outcome(self, start: CubePose, now: CubePose, step: int) -> int:
        """Index into OUTCOMES for the cube at `now` after `step` policy steps of an episode that began at `start`."""
        if now.z - start.z < -self.height_range:
            return DROPPED
        if max(abs(now.x - start.x), abs(now.y - start.y)) > self.plane_range:
            return LEFT_RANGE
        if now.tilt > self.tilt_limit:
            return TILTED
        if now.z - start.z > self.height_range:
            return LIFTED
        return TIME_LIMIT if step >= self.episode_steps else RUNNING
