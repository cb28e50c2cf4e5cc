"""Error that no model can undercut: the scatter of repeats, or the sensor noise; drift between repeats."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Array, Trial
from tactile_cube.measurement.units import milli

LONGEST_LAG = 0.3  # [s] two starts of one command are not further apart
SAME = 0.02  # share of a command's spread by which a repeat may differ
LEFT_START = 0.1  # [rad] of motion after which it no longer matters where friction held a joint at the start
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
    """Return the groups of two or more repeats.

    Trials repeat each other if they are of one kind and their commands agree after a shift in time. Left out are
    bridged samples and a joint's wait at its start, which differs from repeat to repeat and which a simulation starts
    from.
    """
    found = []
    for group in of_one_command(trials):
        if len(group) > 1:
            start = max(lag for _, lag in group)
            members = [(trials[place], start - lag) for place, lag in group]
            measured = [np.where(_telling(trial), trial.position, np.nan)[later:] for trial, later in members]
            length = min(map(len, measured))
            told = np.stack([positions[:length] for positions in measured])
            found.append(Repeats(tuple(trial for trial, _ in members), told))
    return found


def of_one_command(trials: Sequence[Trial]) -> list[list[tuple[int, int]]]:
    """Return the places of the trials of each command, and by how many samples each starts later than the first."""
    groups, waiting = [], [*range(len(trials))]
    while waiting:
        same = repeats_of([trials[place] for place in waiting], 0)
        groups.append([(waiting[0], 0), *((waiting[place], lag) for place, lag in same)])
        taken = {place for place, _ in groups[-1]}
        waiting = [place for place in waiting if place not in taken]
    return groups


def repeats_of(trials: Sequence[Trial], index: int) -> list[tuple[int, int]]:
    """Return the repeats of a trial's command: their places, and by how many samples each starts later in it."""
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
    """Return samples (one a `step` [s]) by which `other` starts later in a command (n, joints); None: another one."""
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
    """Return (n, joints): measured, and the joint has left its start (if it ever does)."""
    left = np.abs(trial.position - trial.position[0]) > LEFT_START
    gone = np.maximum.accumulate(left, axis=0) | ~left.any(axis=0)
    return np.asarray(gone & trial.valid[:, None])


def _standard(values: Array) -> Array:
    """Standardise values (R, ...) to mean 0 and standard deviation 1 over the repeats."""
    centred = values - values.mean(axis=0)
    return np.asarray(centred / np.maximum(centred.std(axis=0), np.finfo(float).tiny))


CHANCE, ORDERS = 0.01, 5000  # probability of that drift by chance, and random orders of the repeats that estimate it
FEWEST_REPEATS = 3


@dataclass(frozen=True)
class Drift:
    """How much better or worse a joint follows the same command from repeat to repeat."""

    joint: str
    # of the RMS error of tracking, or where torques are commanded of the RMS motion, a minute; of a recording without a
    # clock, a repeat [rad]
    change: float
    clock: bool  # whether time stamps go on from trial to trial
    tracking: bool  # whether it is the error of tracking
    repeats: int  # that show it

    def sentence(self, unit: str) -> str:
        """Say it in words; `unit` of the position: rad or m."""
        verb, how = ("follows", ("worse", "better")) if self.tracking else ("answers", ("further", "less far"))
        every = "a minute" if self.clock else "a repeat (its trials count time from 0 each)"
        return (
            f"{self.joint} changes with time: it {verb} the same command {how[self.change < 0.0]} by "
            f"{milli(abs(self.change), unit)} {every}, over {self.repeats} repeats. This is no noise"
        )


def drifts(recording: Recording, groups: Sequence[Repeats], sensor: Array) -> tuple[Drift, ...]:
    """Return joints whose answers to repeated commands go one way with time, beyond chance and noise (n,) [rad].

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
    """Return RMS (joints,) of what a trial is behind its command, or of its motion [rad], its own mean taken out."""
    signal = (trial.command if tracking else 0.0) - trial.position
    return np.asarray(signal[trial.valid].std(axis=0))


LEAST = 1e-6  # [rad] no sensor is better; keeps the ratio of error to floor finite


@dataclass(frozen=True)
class NoiseFloor:
    """RMS error [rad] of a perfect model of this rig and this sensor: a property of the recording alone."""

    overall: float  # pooled over joints
    joints: dict[str, float]
    source: Literal["repeats", "guess", "contact"]  # contact: how well a world with the true effects follows a grasp
    repeats: int  # trials that had a repeat
    step_size: dict[str, float]  # what the simulator's time step adds, no part of the floor; empty: not asked for
    sensor: dict[str, float] = field(default_factory=dict)  # noise of the position sensor, the floor if it is a guess
    drift: tuple[Drift, ...] = ()  # what repeats change by in one direction, no part of the floor

    @property
    def reachable(self) -> float:
        """What a perfect model leaves in this simulator: the floor, with the error of the time step in quadrature."""
        return float(np.hypot(self.overall, np.sqrt(np.mean(np.square([*self.step_size.values()] or [0.0])))))


def noise_floor(recording: Recording, step_size: Mapping[str, float] | None = None) -> NoiseFloor:
    """Return a recording's noise floor; `step_size` is the error [rad] of the simulator's time step by joint."""
    groups = aligned_repeats(recording.trials)
    sensor = sensor_noise(recording)
    variance = np.maximum(sensor, LEAST) ** 2  # repeats of a simulation differ by less than its sensor's noise
    drift = drifts(recording, groups, sensor)
    steady = ~np.isin(recording.joints, [one.joint for one in drift])  # drifting repeats do not show the noise
    if groups:
        variance = np.where(steady, np.maximum(variance, _scatter(groups)), variance)
    return NoiseFloor(
        float(np.sqrt(variance.mean())),
        dict(zip(recording.joints, map(float, np.sqrt(variance)), strict=True)),
        "repeats" if groups and steady.any() else "guess",
        sum(len(group.trials) for group in groups),
        dict(step_size or {}),
        dict(zip(recording.joints, map(float, sensor), strict=True)),
        drift,
    )


def _scatter(groups: Sequence[Repeats]) -> Array:
    """Return the variance (joints,) of a repeat about the mean of its group, each repeat's own constant removed."""
    joints = groups[0].positions.shape[2]
    total, freedom = np.zeros(joints), np.zeros(joints)
    for group in groups:
        stack = np.where(np.isfinite(group.positions).all(axis=0), group.positions, np.nan)
        stack = stack - np.nanmean(stack, axis=1, keepdims=True)
        deviation = stack - stack.mean(axis=0)
        total += np.nansum(deviation**2, axis=(0, 1))
        freedom += np.isfinite(deviation[0]).sum(axis=0) * (len(stack) - 1)
    return np.asarray(total / freedom)


WEIGHTS = np.array([1.0, -4.0, 6.0, -4.0, 1.0])  # fourth difference: motion is smooth on this scale, noise is not
SMALLEST = 1e-6  # part of the range of motion


def sensor_noise(recording: Recording) -> Array:
    """Return the white part (n,) of the position signals [rad], robust against jumps; at least what is stated."""
    sensors = recording.description.sensors
    signals = [[t.position[t.valid, j] for t in recording.trials] for j in range(len(recording.joints))]
    steps = [sensors.position_resolution or reading_step(np.concatenate(one)) for one in signals]
    stated = [np.hypot(step / np.sqrt(12.0), sensors.position_noise) for step in steps]
    return np.array([_noise(one, float(least)) for one, least in zip(signals, stated, strict=True)])


WHOLE, MOSTLY = 0.1, 0.98  # of a step by which a change may miss a multiple of it; share of changes that keep it
FEWEST_VALUES = 20  # distinct values of a signal: with fewer, chance looks like a resolution
FEW_STEPS = 20  # a larger change is a multiple of any small step, within what its digits tell


def reading_step(signal: Array) -> float:
    """Return the resolution [rad] of readings (n,) whose changes are multiples of it; 0 where they show none."""
    values = np.unique(signal)
    if len(values) < FEWEST_VALUES:
        return 0.0
    gaps = np.diff(values)
    gaps = gaps[gaps > SMALLEST * float(np.ptp(values))]  # smaller ones are the last digit of one value
    step = float(np.quantile(gaps, 0.1)) if len(gaps) else 0.0
    near = gaps[gaps < FEW_STEPS * step] / step if step else gaps
    whole = np.abs(near - np.round(near)) < WHOLE
    return step if len(near) and whole.mean() > MOSTLY else 0.0


def noise_with_links(recording: Recording) -> Array:
    """Return the sensor noise (2 n,) [rad]: of joints, see `sensor_noise`, then of link sensors, nan without one."""
    noise = np.concatenate([sensor_noise(recording), np.full(len(recording.joints), np.nan)])
    for j in recording.linked:
        shown = [t.link_position[t.valid, j] for t in recording.trials if t.link_position is not None and j in t.linked]
        noise[len(recording.joints) + j] = _noise(shown)
    return noise


def _noise(signals: Sequence[Array], stated: float = 0.0) -> float:
    least = SMALLEST * float(np.ptp(np.concatenate(signals)))
    return max(float(np.median([_white(signal) for signal in signals])), stated, least)


def _white(signal: Array) -> float:
    if len(signal) <= len(WEIGHTS):
        return 0.0
    fast = np.convolve(signal, WEIGHTS, mode="valid") / np.sqrt(np.sum(WEIGHTS**2))
    calm = np.abs(fast) <= 5.0 * np.median(np.abs(fast)) / 0.6745
    return float(np.sqrt(np.mean(fast[calm] ** 2)))
