"""The error that no model can undercut: the scatter of repeats, and the simulator's own step-size error."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.comparing.error import ErrorSummary
from tactile_cube.measurement.comparing.repeats import aligned_repeats
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial

Array = NDArray[np.float64]
LEAST = 1e-6  # [rad] no sensor is better; keeps the ratio of error to floor finite
SMOOTHING = 0.05  # [s] a position that changes faster than this is taken for noise where nothing was repeated


@dataclass(frozen=True)
class NoiseFloor:
    """RMS error [rad] of a perfect model of this rig, this sensor and this simulator.

    Attributes:
        overall: pooled over joints.
        joints: joint by joint.
        source: `repeats` (measured), `guess` (nothing was repeated), or `contact` (how well a world with the true
            effects follows a grasp).
        repeats: how many trials had a repeat.
        step_size: the part that comes from the simulator's time step, joint by joint; empty if not included.
    """

    overall: float
    joints: dict[str, float]
    source: Literal["repeats", "guess", "contact"]
    repeats: int
    step_size: dict[str, float]


def noise_floor(recording: Recording, step_size: ErrorSummary | None = None) -> NoiseFloor:
    """Noise floor of a recording; `step_size` is the error of the simulator's time step, added in quadrature."""
    groups = aligned_repeats(recording.trials)
    if groups:
        variance, source = _scatter(groups), "repeats"
    else:
        variance, source = sensor_noise(recording) ** 2, "guess"
    variance = np.maximum(variance, LEAST**2)
    measured = NoiseFloor(
        float(np.sqrt(variance.mean())),
        dict(zip(recording.joints, map(float, np.sqrt(variance)), strict=True)),
        "repeats" if source == "repeats" else "guess",
        sum(len(group) for group in groups),
        {},
    )
    return measured if step_size is None else with_step_size(measured, step_size)


def with_step_size(floor: NoiseFloor, step_size: ErrorSummary) -> NoiseFloor:
    """The floor with the error of the simulator's time step added in quadrature."""
    joints = {joint: float(np.hypot(value, step_size.joints[joint])) for joint, value in floor.joints.items()}
    overall = float(np.hypot(floor.overall, step_size.overall))
    return replace(floor, overall=overall, joints=joints, step_size=dict(step_size.joints))


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


def sensor_noise(recording: Recording) -> Array:
    """Noise (joints,) [rad] of the position: what is too fast to be motion, at least the sensor's own steps."""
    fast = np.concatenate([_fast_part(trial)[trial.valid] for trial in recording.trials])
    sensors = recording.description.sensors
    least = sensors.position_resolution**2 / 12 + sensors.position_noise**2
    return np.asarray(np.sqrt(np.maximum(np.median(np.abs(fast), axis=0) ** 2 / 0.6745**2, least)))


def _fast_part(trial: Trial) -> Array:
    """Position minus a sliding parabola, scaled so that white noise keeps its variance."""
    half = max(2, min(round(SMOOTHING / trial.step), (len(trial.time) - 1) // 2))
    lever = np.arange(-half, half + 1, dtype=np.float64)
    basis = np.stack([np.ones_like(lever), lever, lever**2], axis=1)
    weights = (basis @ np.linalg.pinv(basis))[half]
    padded = np.pad(trial.position, ((half, half), (0, 0)), mode="reflect", reflect_type="odd")
    smooth = np.stack([np.convolve(column, weights, mode="valid") for column in padded.T], axis=1)
    return np.asarray((trial.position - smooth) / np.sqrt(1 - weights[half]))
