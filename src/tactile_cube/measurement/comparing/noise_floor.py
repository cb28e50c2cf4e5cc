"""The error that no model can undercut: the scatter of repeats, or the sensor's noise where nothing was repeated."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.comparing.error import ErrorSummary
from tactile_cube.measurement.comparing.repeats import aligned_repeats
from tactile_cube.measurement.recordings.recording import Recording

Array = NDArray[np.float64]
LEAST = 1e-6  # [rad] no sensor is better; keeps the ratio of error to floor finite


@dataclass(frozen=True)
class NoiseFloor:
    """RMS error [rad] of a perfect model of this rig and this sensor: a property of the recording alone.

    Attributes:
        overall: pooled over joints.
        joints: joint by joint.
        source: `repeats` (measured), `guess` (nothing was repeated), or `contact` (how well a world with the true
            effects follows a grasp).
        repeats: how many trials had a repeat.
        sensor: noise of the position sensor, joint by joint; the floor itself where it is a guess.
        step_size: what the simulator's own time step adds to a perfect model's error, joint by joint; no part of the
            floor, and empty where it was not asked for.
    """

    overall: float
    joints: dict[str, float]
    source: Literal["repeats", "guess", "contact"]
    repeats: int
    step_size: dict[str, float]
    sensor: dict[str, float] = field(default_factory=dict)

    @property
    def reachable(self) -> float:
        """What a perfect model leaves in this simulator: the floor, with the error of the time step in quadrature."""
        return float(np.hypot(self.overall, np.sqrt(np.mean(np.square([*self.step_size.values()] or [0.0])))))


def noise_floor(recording: Recording, step_size: ErrorSummary | None = None) -> NoiseFloor:
    """Noise floor of a recording; `step_size` is the error of the simulator's time step, stated beside it."""
    groups = aligned_repeats(recording.trials)
    sensor = sensor_noise(recording)
    variance = _scatter(groups) if groups else sensor**2
    variance = np.maximum(variance, LEAST**2)
    return NoiseFloor(
        float(np.sqrt(variance.mean())),
        dict(zip(recording.joints, map(float, np.sqrt(variance)), strict=True)),
        "repeats" if groups else "guess",
        sum(len(group) for group in groups),
        dict(step_size.joints) if step_size is not None else {},
        dict(zip(recording.joints, map(float, sensor), strict=True)),
    )


def _scatter(groups: list[list[Array]]) -> Array:
    """Variance (joints,) of a repeat about the mean of its group, each repeat's own constant removed."""
    joints = groups[0][0].shape[1]
    total, freedom = np.zeros(joints), np.zeros(joints)
    for group in groups:
        stack = np.stack(group)
        stack = np.where(np.isfinite(stack).all(axis=0), stack, np.nan)
        stack = stack - np.nanmean(stack, axis=1, keepdims=True)
        deviation = stack - stack.mean(axis=0)
        total += np.nansum(deviation**2, axis=(0, 1))
        freedom += np.isfinite(deviation[0]).sum(axis=0) * (len(group) - 1)
    return np.asarray(total / freedom)


WEIGHTS = np.array([1.0, -4.0, 6.0, -4.0, 1.0])  # fourth difference: motion is smooth on this scale, noise is not
SMALLEST = 1e-6  # part of the range of motion


def sensor_noise(recording: Recording) -> Array:
    """White part (n,) of the position signals [rad], robust against jumps; at least what the owner states of it."""
    positions = np.concatenate([trial.position for trial in recording.trials])
    least = SMALLEST * np.ptp(positions, axis=0)
    estimates = [
        [_white(trial.position[trial.valid, j]) for j in range(len(recording.joints))] for trial in recording.trials
    ]
    sensors = recording.description.sensors
    stated = np.hypot(sensors.position_resolution / np.sqrt(12.0), sensors.position_noise)
    white = np.median(np.array(estimates), axis=0)
    return np.asarray(np.maximum(white, np.maximum(stated, least)))


def _white(signal: Array) -> float:
    if len(signal) <= len(WEIGHTS):
        return 0.0
    fast = np.convolve(signal, WEIGHTS, mode="valid") / np.sqrt(np.sum(WEIGHTS**2))
    calm = np.abs(fast) <= 5.0 * np.median(np.abs(fast)) / 0.6745
    return float(np.sqrt(np.mean(fast[calm] ** 2)))
