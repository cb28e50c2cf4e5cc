"""A recording cut for multiple shooting: stretches that are simulated in one go, made of short segments started anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.recording import Recording
from tactile_cube.measurement.trial import Trial

Array = NDArray[np.float64]
SEGMENT = 0.4  # [s] identification works best with 0.2-0.5 s: longer, and a wrong start is no longer told from a wrong model
STRETCH = 10  # segments simulated without a break, so that effects with a memory keep it
HISTORY = 0.12  # [s] of commands before a stretch, for effects that remember them
SMOOTHING = 0.025  # [s] half width of the parabola that reads the state at a segment's start


@dataclass(frozen=True)
class Stretches:
    """S stretches of K segments of `segment` rows each; n joints.

    Attributes:
        commands: (S, H + K segment, n) commands at the middle of each step, after `history` rows of the past [rad].
        measured: (S, K segment, n) measured positions [rad].
        weight: (S, K segment, n) 1 / sensor noise; 0 where nothing was measured [1/rad].
        position: (S, K, n) measured position at each segment's start [rad].
        speed: (S, K, n) [rad/s].
        acceleration: (S, K, n) measured at each segment's start, a gauge of how well the speed is known [rad/s^2].
        trial: (S,) index of the trial.
        initialisation: (S,) robot initialisation.
        time: (S,) of the first row in its trial [s].
        history: H.
        segment: rows of a segment.
    """

    commands: Array
    measured: Array
    weight: Array
    position: Array
    speed: Array
    acceleration: Array
    trial: NDArray[np.int64]
    initialisation: NDArray[np.int64]
    time: Array
    history: int
    segment: int

    @property
    def segments(self) -> int:
        """K, segments of a stretch."""
        return self.position.shape[1]

    def __len__(self) -> int:
        return len(self.commands)

    def take(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Stretches:
        """Some of the stretches."""
        rows = ("commands", "measured", "weight", "position", "speed", "acceleration", "trial", "initialisation", "time")
        return replace(self, **{key: getattr(self, key)[chosen] for key in rows})

    def by_segment(self, values: Array) -> Array:
        """(S, K segment, n) -> (S K, segment n)."""
        return values.reshape(len(self) * self.segments, -1)


def cut(
    recording: Recording, noise: Array, trials: Sequence[Trial] | None = None, segment: int | None = None
) -> Stretches:
    """The trials of a recording as stretches.

    Args:
        recording: gives the joints and the sampling step.
        noise: (n,) standard deviation of the position sensor of each joint [rad].
        trials: all of the recording's by default.
        segment: rows of a segment; as short as identification likes it by default.
    """
    trials = recording.trials if trials is None else trials
    longest = max(len(trial.time) for trial in trials)
    segment = min(segment or max(8, round(SEGMENT / recording.step)), longest)
    count = min(STRETCH, -(-longest // segment))
    ratio = recording.gains.kp / recording.nominal.get("stiffness", np.full(len(recording.joints), np.inf))
    elastic = ratio / (1.0 + ratio)
    pieces = [piece for k, trial in enumerate(trials) for piece in _pieces(trial, k, segment, count, noise, recording.read, elastic)]
    names = ("commands", "measured", "weight", "position", "speed", "acceleration", "trial", "initialisation", "time")
    columns = {name: np.array([piece[name] for piece in pieces]) for name in names}
    return Stretches(**columns, history=round(HISTORY / recording.step), segment=segment)


def _pieces(
    trial: Trial, index: int, segment: int, count: int, noise: Array, reading: str, elastic: Array
) -> list[dict[str, object]]:
    rows, history = segment * count, round(HISTORY / trial.step)
    middle = _impulses(trial.command, reading)
    measured = trial.position + _half_jump(middle, reading, elastic)
    pieces = []
    for first in range(0, len(trial.time), rows):
        wanted = np.arange(first - history, first + rows)
        inside = (np.arange(first, first + rows) < len(trial.time))[:, None]
        usable = np.clip(np.arange(first, first + rows), 0, len(trial.time) - 1)
        weight = np.where(inside & trial.valid[usable][:, None], 1.0 / noise, 0.0)
        if np.count_nonzero(weight[:, 0]) < 4:
            continue
        state = _states(trial, np.minimum(first + segment * np.arange(count), len(trial.time) - 1))
        pieces.append(
            {
                "commands": middle[np.clip(wanted, 0, len(trial.time) - 1)],
                "measured": measured[usable],
                "weight": weight,
                "position": state[0],
                "speed": state[1],
                "acceleration": state[2],
                "trial": index,
                "initialisation": trial.initialisation,
                "time": first * trial.step,
            }
        )
    return pieces


def _impulses(command: Array, reading: str) -> Array:
    """Commands (T, n) as a step of the simulation takes them: an impulse at the instant that row k reads.

    A held command acts as the mean of the commands before and after that instant (second order in the step). Row k is
    read at the end of the period in which command k acts, or at its beginning.
    """
    middle = command.copy()
    if reading == "after":
        middle[:-1] = 0.5 * (command[:-1] + command[1:])
    else:
        middle[1:] = 0.5 * (command[:-1] + command[1:])
    return middle


def _half_jump(middle: Array, reading: str, elastic: Array) -> Array:
    """What the drive's deflection at the instant of reading lacks of that under the mean command (T, n) [rad]."""
    jump = np.zeros_like(middle)
    jump[1:-1] = 0.25 * (middle[2:] - middle[:-2])
    return elastic * jump if reading == "after" else -elastic * jump


def _states(trial: Trial, rows: NDArray[np.int64]) -> tuple[Array, Array, Array]:
    """Position, speed and acceleration (K, n) at some rows: a parabola through the samples around each."""
    half = max(2, round(SMOOTHING / trial.step))
    found = []
    for row in rows:
        near = slice(max(0, row - half), min(len(trial.time), row + half + 1))
        basis = np.vander(trial.time[near] - trial.time[row], 3, increasing=True)
        found.append(np.linalg.lstsq(basis, trial.position[near], rcond=None)[0])
    states = np.array(found)
    return states[:, 0], states[:, 1], 2.0 * states[:, 2]
