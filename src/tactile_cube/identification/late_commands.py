"""Commands that were logged rows after they were sent, so that the machine moves before them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.identification.search.division import Division
from tactile_cube.measurement.comparing.noise_floor import sensor_noise
from tactile_cube.measurement.recordings.recording import Recording

MOST = 64  # rows looked at
SEGMENTS = 32  # that tell them apart
NEARER = -0.5  # rows: a reading that is as early comes nearer to its stamp with commands a row earlier


def in_time(
    recording: Recording,
    effects: Sequence[type[Effect]],
    say: Callable[[str], None],
    known: ModelFile | None = None,
) -> Recording:
    """Return the recording with its commands as many rows earlier as the machine moves before them.

    What is within half a row is fitted (`reading_delay`).

    Args:
        recording: any.
        effects: classes to compile in; their kernel is used again by a search for them.
        say: takes a line where they become earlier.
        known: the model to begin with; None: what the recording's owner states.
    """
    if recording.description.controller.mode == "torque":
        return recording

    rows, (error, reading) = 0, _fitted(recording, effects, known)
    while reading < NEARER and rows < MOST:
        further, later = _fitted(_earlier(recording, rows + 1), effects, known)
        if further > error:
            break
        rows, error, reading = rows + 1, further, later
    if not rows:
        return recording
    say(
        f"the machine moves {rows} rows ({1e3 * rows * recording.step:.3g} ms) before its commands, which were logged "
        "late: they are taken that much earlier"
    )
    return _earlier(recording, rows)


def _fitted(recording: Recording, effects: Sequence[type[Effect]], known: ModelFile | None) -> tuple[float, float]:
    """Error of the base model [sensor noise], and when the joint that is read last is read [rows after its stamp]."""
    shooting, noise = Shooting(recording, effects), sensor_noise(recording)
    base = Division(shooting, recording, recording, noise, known=known, segments=SEGMENTS).fit_base()
    return base.error, float(base.fit.model.constants["reading_delay"].max() / recording.step)


def _earlier(recording: Recording, rows: int) -> Recording:
    """The recording with commands so many rows earlier; of its last rows nothing is known."""
    trials = []
    for trial in recording.trials:
        command = np.concatenate([trial.command[rows:], np.repeat(trial.command[-1:], rows, axis=0)])
        valid = trial.valid & (np.arange(len(trial.valid)) < len(trial.valid) - rows)
        trials.append(replace(trial, command=command, valid=valid))
    return recording.with_trials(trials)
