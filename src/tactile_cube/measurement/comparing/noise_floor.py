"""The error that no model can undercut: the scatter of repeats, or the sensor's noise where nothing was repeated."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from tactile_cube.measurement.comparing.repeats import Drift, Repeats, aligned_repeats, drifts
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Array

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
    """Noise floor of a recording; `step_size` is the error [rad] of the simulator's time step, joint by joint."""
    groups = aligned_repeats(recording.trials)
    sensor = sensor_noise(recording)
    variance = np.maximum(sensor, LEAST) ** 2  # repeats of a simulation differ by less than its sensor's noise
    drift = drifts(recording, groups, sensor)
    steady = ~np.isin(recording.joints, [one.joint for one in drift])  # where a machine changes repeats tell no noise
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
    """Variance (joints,) of a repeat about the mean of its group, each repeat's own constant removed."""
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
    """White part (n,) of the position signals [rad], robust against jumps; at least what the owner states of it."""
    sensors = recording.description.sensors
    signals = [[t.position[t.valid, j] for t in recording.trials] for j in range(len(recording.joints))]
    steps = [sensors.position_resolution or reading_step(np.concatenate(one)) for one in signals]
    stated = [np.hypot(step / np.sqrt(12.0), sensors.position_noise) for step in steps]
    return np.array([_noise(one, float(least)) for one, least in zip(signals, stated, strict=True)])


WHOLE, MOSTLY = 0.1, 0.98  # of a step by which a change may miss a multiple of it; share of changes that keep it
FEWEST_VALUES = 20  # that a signal takes: with fewer gaps chance looks like a step
FEW_STEPS = 20  # a larger change is a multiple of any small step, within what its digits tell


def reading_step(signal: Array) -> float:
    """Resolution of a sensor [rad] that its readings (n,) show: changes are multiples of it; 0 where they show none."""
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
    """The same, and after it that of the sensors on links, nan where there are none (2 n,) [rad]."""
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
