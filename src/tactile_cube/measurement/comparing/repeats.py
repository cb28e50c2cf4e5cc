"""Trials that repeat a command: which ones they are, and whether the machine changes from one to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.units import milli

Array = NDArray[np.float64]
LONGEST_LAG = 0.3  # [s] two starts of one command are not further apart
SAME = 0.02  # share of a command's spread by which a repeat may differ
LEFT_START = 0.1  # [rad] of motion after which a joint no longer knows where friction held it at the start
SHORTEST = 0.8  # share of the shorter trial that must overlap


class Repeats(NamedTuple):
    """Trials of one command, and their positions (R, n, joints) [rad], nan where they say nothing about noise."""

    trials: tuple[Trial, ...]
    positions: Array

    @property
    def time(self) -> Array:
        """When each began (R,) [s]; their numbers where they have no clock."""
        begun = np.array([trial.begun for trial in self.trials])
        return begun if begun.any() else np.arange(float(len(begun)))


def aligned_repeats(trials: Sequence[Trial]) -> list[Repeats]:
    """Groups of two or more repeats.

    Trials repeat each other if they are of one kind and their commands agree after a shift in time. Left out are
    bridged samples and a joint's wait at its start, which differs from repeat to repeat and which a simulation starts
    from.
    """
    groups: list[Repeats] = []
    waiting = list(trials)
    while waiting:
        same = repeats_of(waiting, 0)
        if same:
            members = [(waiting[0], 0), *((waiting[place], lag) for place, lag in same)]
            start = max(0, *(lag for _, lag in members))
            measured = [np.where(_telling(trial), trial.position, np.nan)[start - lag :] for trial, lag in members]
            length = min(map(len, measured))
            told = np.stack([positions[:length] for positions in measured])
            groups.append(Repeats(tuple(trial for trial, _ in members), told))
        taken = {0, *(place for place, _ in same)}
        waiting = [trial for place, trial in enumerate(waiting) if place not in taken]
    return groups


def repeats_of(trials: Sequence[Trial], index: int) -> list[tuple[int, int]]:
    """Trials that play the command of one again: their places, and by how many samples each starts later in it."""
    first = trials[index]
    lags = {
        place: lag_between(first.command, other.command, first.step)
        for place, other in enumerate(trials)
        if place != index
        and (first.kind, first.clamped, first.force) == (other.kind, other.clamped, other.force)
        and all(np.array_equal(getattr(first.gains, k), getattr(other.gains, k)) for k in ("kp", "kd"))
    }
    return [(place, lag) for place, lag in lags.items() if lag is not None]


def lag_between(first: Array, other: Array, step: float) -> int | None:
    """Samples (one a `step` [s]) by which `other` starts later in the same command (n, joints); None: another one."""
    if len(first) == len(other) and _differs(first, other) < SAME:
        return 0
    longest = round(LONGEST_LAG / step)
    best, difference = 0, np.inf
    for lag in range(-longest, longest + 1):
        a, b = first[max(lag, 0) :], other[max(-lag, 0) :]
        n = min(len(a), len(b))
        if n >= SHORTEST * min(len(first), len(other)) and (d := _differs(a[:n], b[:n])) < difference:
            best, difference = lag, d
    return best if difference < SAME else None


def _differs(first: Array, other: Array) -> float:
    spread = float(np.sqrt(np.mean((first - first.mean(axis=0)) ** 2)))
    return float(np.sqrt(np.mean((first - other) ** 2))) / spread if spread > 0 else np.inf


def _telling(trial: Trial) -> NDArray[np.bool_]:
    """(n, joints): measured, and the joint has left its start (if it ever does)."""
    left = np.abs(trial.position - trial.position[0]) > LEFT_START
    gone = np.maximum.accumulate(left, axis=0) | ~left.any(axis=0)
    return np.asarray(gone & trial.valid[:, None])


def _standard(values: Array) -> Array:
    """Values (R, ...) with mean 0 and standard deviation 1 over the repeats."""
    centred = values - values.mean(axis=0)
    return np.asarray(centred / np.maximum(centred.std(axis=0), np.finfo(float).tiny))


CHANCE, ORDERS = 0.01, 5000  # probability of such a drift by chance, and random orders of the repeats that tell it
FEWEST_REPEATS = 3


@dataclass(frozen=True)
class Drift:
    """How much better or worse a joint follows the same command from repeat to repeat.

    Attributes:
        joint: its name.
        change: of the RMS error of tracking, or where torques are commanded of the RMS motion, a minute; of a recording
            without a clock, a repeat [rad].
        clock: whether time stamps go on from trial to trial.
        tracking: whether it is the error of tracking.
        repeats: how many tell it.
    """

    joint: str
    change: float
    clock: bool
    tracking: bool
    repeats: int

    def sentence(self, unit: str) -> str:
        """In words; `unit` of the position: rad or m."""
        verb, how = ("follows", ("worse", "better")) if self.tracking else ("answers", ("further", "less far"))
        every = "a minute" if self.clock else "a repeat (its trials count time from 0 each)"
        return (
            f"{self.joint} changes with time: it {verb} the same command {how[self.change < 0.0]} by "
            f"{milli(abs(self.change), unit)} {every}, over {self.repeats} repeats. This is no noise"
        )


def drifts(recording: Recording, groups: Sequence[Repeats], sensor: Array) -> tuple[Drift, ...]:
    """Joints whose answers to repeated commands go one way with time, beyond chance and the sensor's noise (n,) [rad].

    Source: Good, Permutation, Parametric, and Bootstrap Tests of Hypotheses, 2005 (a trend by permutation).
    """
    groups = [one for one in groups if len(one.trials) >= FEWEST_REPEATS]
    if not groups:
        return ()
    tracking = not recording.torque_controlled
    levels = [np.stack([_level(trial, tracking) for trial in one.trials]) for one in groups]
    rng = np.random.default_rng(0)
    trend, by_chance = np.zeros(sensor.shape), np.zeros((ORDERS, len(sensor)))
    slope, weight = np.zeros(sensor.shape), 0.0
    for group, level in zip(groups, levels, strict=True):
        time = group.time - group.time.mean()
        trend += _standard(time) @ _standard(level)
        by_chance += rng.permuted(np.tile(_standard(time), (ORDERS, 1)), axis=1) @ _standard(level)
        slope, weight = slope + time @ level, weight + float(time @ time)
    probability = (1 + np.count_nonzero(np.abs(by_chance) >= np.abs(trend) - 1e-9, axis=0)) / (ORDERS + 1)
    slope = slope / max(weight, np.finfo(float).tiny)
    moved = np.abs(slope) * max(float(np.ptp(one.time)) for one in groups)
    clock = any(trial.begun for one in groups for trial in one.trials)
    count = sum(len(one.trials) for one in groups)
    return tuple(
        Drift(joint, float(slope[j] * (60.0 if clock else 1.0)), clock, tracking, count)
        for j, joint in enumerate(recording.joints)
        if probability[j] < CHANCE and moved[j] > sensor[j]
    )


def _level(trial: Trial, tracking: bool) -> Array:
    """RMS (joints,) of what a trial is behind its command, or of its motion [rad], its own mean taken out."""
    signal = (trial.command if tracking else 0.0) - trial.position
    return np.asarray(signal[trial.valid].std(axis=0))
