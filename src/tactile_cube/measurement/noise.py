"""Standard deviation of the position sensor, read from the recording itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.recordings.recording import Recording

Array = NDArray[np.float64]
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
