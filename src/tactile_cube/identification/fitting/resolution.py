"""Simulation steps so short that shorter ones would change nothing that the sensors show."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.fitting.base import base_unknowns, every_effect, nominal_model
from tactile_cube.identification.fitting.model import Model
from tactile_cube.identification.fitting.noise import sensor_noise
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.identification.fitting.time_step import finer
from tactile_cube.identification.fitting.windows import cut, steps_per_row
from tactile_cube.measurement.recordings.recording import Recording

Array = NDArray[np.float64]
FINEST = 8  # times as short steps at most: so much longer does a diagnosis take
HIDDEN = (
    0.3  # of the sensor noise: an error of 0.3 beside it makes 1.04 of 1, less than anything that is asked of a model
)


def resolved(
    recording: Recording,
    effects: Sequence[type[Effect]],
    say: Callable[[str], None],
    known: ModelFile | None = None,
) -> Recording:
    """The recording with steps that its noise calls for, where the controller's rate is not stated.

    Rows far apart and a fine encoder show what steps leave out that suffice elsewhere: torque limits that are reached
    between two rows above all.

    Args:
        recording: any.
        effects: classes to compile in; their kernel is used again by a search for them.
        say: takes a line where steps become shorter.
        known: the model to simulate; None: what the recording's owner states.
    """
    if recording.description.controller.rate_hz is not None:
        return recording
    start = nominal_model(recording, known)
    shooting = Shooting(recording, every_effect(effects, start))
    left = step_error(recording, shooting, start, sensor_noise(recording))
    times = next((k for k in (1, 2, 4) if left <= HIDDEN * k), FINEST)  # errors of the step are of first order
    if times == 1:
        return recording
    rate = steps_per_row(recording, shooting.time) * times * recording.rate
    say(f"shorter steps move {left:.1f} x sensor noise: simulated at {rate:g} Hz (controller.rate_hz states it)")
    return recording.with_controller_rate(rate)


def step_error(recording: Recording, shooting: Shooting, model: Model, noise: Array) -> float:
    """RMS [sensor noise] by which steps `FINEST` times as short move what constants and starts cannot follow."""
    windows = cut(recording, noise, time=shooting.time)
    own, fine = Problem(shooting, windows), Problem(shooting.finer(FINEST), finer(windows, FINEST))
    for problem in (own, fine):
        problem.linearise_starts(model)
    prediction, columns = own.columns(model, base_unknowns(recording, model.constants, shooting.sizes))
    moved = own.limited(fine.predictions([model])[0] - prediction) * own.weight
    flat, free = columns.reshape(-1, columns.shape[-1]), own.free(columns).reshape(-1, columns.shape[-1])
    share = np.linalg.lstsq(free.T @ flat, free.T @ moved.ravel(), rcond=None)[0]
    left = moved - columns @ share
    return float(np.sqrt(own.cost(left).sum() / np.count_nonzero(own.weight)))
