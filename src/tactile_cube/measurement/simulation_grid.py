"""A recording on the grid of a simulation: what was measured slowly, read early or commanded as torque, in one form."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.parameters import TORQUE_MODE_GAIN
from tactile_cube.measurement.recording import Recording
from tactile_cube.measurement.trial import Gains, Trial

Array = NDArray[np.float64]


def on_simulation_grid(recording: Recording, step: float = 0.002) -> Recording:
    """The same recording with rows at most `step` [s] apart, each read at the end of its row, commands as positions.

    Commands are held between the rows that were recorded, positions are interpolated, and only rows that were really
    measured stay `valid`. A recording that has this form already comes back as it is.
    """
    factor = max(1, int(np.ceil(recording.step / step - 1e-6)))
    if factor == 1 and recording.read == "after" and not recording.torque_controlled:
        return recording
    controller, sensors = recording.description.controller, recording.description.sensors
    description = recording.description.model_copy(
        update={
            "rate_hz": recording.rate * factor,
            "controller": controller.model_copy(update={"mode": "position"}),
            "sensors": sensors.model_copy(update={"read": "after"}),
        }
    )
    gains = _torque_gains(recording.gains) if recording.torque_controlled else recording.gains
    trials = tuple(_refined(trial, recording, factor) for trial in recording.trials)
    return replace(recording, description=description, gains=gains, trials=trials)


def _refined(trial: Trial, recording: Recording, factor: int) -> Trial:
    command, gains = trial.command, trial.gains
    if recording.torque_controlled:
        command, gains = command / TORQUE_MODE_GAIN, _torque_gains(gains)
    rows = len(trial.time) * factor
    fine = trial.step / factor
    ends: Array = (np.arange(rows, dtype=np.float64) + 1) * fine
    read = trial.time + (trial.step if recording.read == "after" else 0.0)
    valid = np.zeros(rows, dtype=bool)
    measured = np.round(read / fine).astype(int) - 1
    inside = measured >= 0
    valid[measured[inside]] = trial.valid[inside]
    torque = None if trial.torque is None else _interpolated(ends, read, trial.torque)
    return replace(
        trial,
        time=np.asarray(ends - fine, dtype=np.float64),
        command=np.repeat(command, factor, axis=0),
        position=_interpolated(ends, read, trial.position),
        torque=torque,
        valid=valid,
        gains=gains,
    )


def _torque_gains(gains: Gains) -> Gains:
    """Gains that turn the position u / gain into the torque u."""
    return Gains(np.full_like(gains.kp, TORQUE_MODE_GAIN), np.zeros_like(gains.kd), gains.torque_limit)


def _interpolated(at: NDArray[np.floating], time: NDArray[np.floating], values: Array) -> Array:
    """Straight lines between the samples, prolonged beyond the first and the last."""
    padded_time = np.concatenate([[2 * time[0] - time[1]], time, [2 * time[-1] - time[-2]]])
    ends = 2 * values[0] - values[1], 2 * values[-1] - values[-2]
    padded = np.vstack([ends[0], values, ends[1]])
    return np.stack([np.interp(at, padded_time, column) for column in padded.T], axis=1)
