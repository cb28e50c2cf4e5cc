"""Trials that repeat one command, aligned in time by that command."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.recordings.trial import Trial

Array = NDArray[np.float64]
LONGEST_LAG = 0.3  # [s] two starts of one command are not further apart
SAME = 0.02  # share of a command's spread by which a repeat may differ
LEFT_START = 0.1  # [rad] of motion after which a joint no longer knows where friction held it at the start
SHORTEST = 0.8  # share of the shorter trial that must overlap


def aligned_repeats(trials: Sequence[Trial]) -> list[list[Array]]:
    """Groups of two or more repeats; each is (n, joints) positions [rad], nan where it says nothing about noise.

    Trials repeat each other if they are of one kind and their commands agree after a shift in time. Left out are
    bridged samples and a joint's wait at its start, which differs from repeat to repeat and which a simulation starts
    from.
    """
    groups: list[list[Array]] = []
    waiting = list(trials)
    while waiting:
        first, rest = waiting[0], waiting[1:]
        lags = {
            index: lag_between(first.command, other.command, first.step)
            for index, other in enumerate(rest)
            if _comparable(first, other)
        }
        same = {index: lag for index, lag in lags.items() if lag is not None}
        if same:
            groups.append(_cut([(first, 0), *((rest[index], lag) for index, lag in same.items())]))
        waiting = [other for index, other in enumerate(rest) if index not in same]
    return groups


def repeats_of(trials: Sequence[Trial], index: int) -> list[tuple[int, int]]:
    """Trials that play the command of one again: their places, and by how many samples each starts later in it."""
    first = trials[index]
    lags = {
        place: lag_between(first.command, other.command, first.step)
        for place, other in enumerate(trials)
        if place != index and _comparable(first, other)
    }
    return [(place, lag) for place, lag in lags.items() if lag is not None]


def _comparable(first: Trial, other: Trial) -> bool:
    same_gains = all(np.array_equal(getattr(first.gains, k), getattr(other.gains, k)) for k in ("kp", "kd"))
    return first.kind == other.kind and same_gains and first.clamped == other.clamped and first.force == other.force


def lag_between(first: Array, other: Array, step: float) -> int | None:
    """Samples by which `other` starts later in the same command (n, joints), or None where it is another command.

    Args:
        first: a command.
        other: a command at the same rate.
        step: time between samples [s].
    """
    if len(first) == len(other) and _differs(first, other) < SAME:
        return 0
    longest = round(LONGEST_LAG / step)
    best, difference = 0, np.inf
    for lag in range(-longest, longest + 1):
        a, b = _overlap(first, other, lag)
        if len(a) >= SHORTEST * min(len(first), len(other)) and (d := _differs(a, b)) < difference:
            best, difference = lag, d
    return best if difference < SAME else None


def _overlap(first: Array, other: Array, lag: int) -> tuple[Array, Array]:
    """The parts of two signals that lie at the same time if `other` is shifted by `lag` samples."""
    a, b = first[max(lag, 0) :], other[max(-lag, 0) :]
    n = min(len(a), len(b))
    return a[:n], b[:n]


def _differs(first: Array, other: Array) -> float:
    spread = float(np.sqrt(np.mean((first - first.mean(axis=0)) ** 2)))
    return float(np.sqrt(np.mean((first - other) ** 2))) / spread if spread > 0 else np.inf


def _cut(members: list[tuple[Trial, int]]) -> list[Array]:
    start = max(0, *(lag for _, lag in members))
    measured = [np.where(_telling(trial), trial.position, np.nan)[start - lag :] for trial, lag in members]
    length = min(map(len, measured))
    return [positions[:length] for positions in measured]


def _telling(trial: Trial) -> NDArray[np.bool_]:
    """(n, joints): measured, and the joint has left its start (if it ever does)."""
    left = np.abs(trial.position - trial.position[0]) > LEFT_START
    gone = np.maximum.accumulate(left, axis=0) | ~left.any(axis=0)
    return np.asarray(gone & trial.valid[:, None])
