"""Commands that were logged rows after they were sent, so that the machine moves before them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.identification.search.division import Division
from tactile_cube.measurement.comparing.noise_floor import noise_with_links
from tactile_cube.measurement.recordings.description import MOST_LATE
from tactile_cube.measurement.recordings.reading import DESCRIPTION
from tactile_cube.measurement.recordings.recording import Recording

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
    while reading < NEARER and rows < MOST_LATE:
        further, later = _fitted(_earlier(recording, rows + 1), effects, known)
        if further > error:
            break
        rows, error, reading = rows + 1, further, later
    if not rows:
        return recording
    stated = recording.description.sensors.commands_late
    say(
        f"the machine moves {rows} rows ({1e3 * rows * recording.step:.3g} ms) before its commands, which were logged "
        f"late: they are taken that much earlier. Write `commands_late: {stated + rows}` below `sensors:` in "
        f"{recording.folder / DESCRIPTION}, so that every command does"
    )
    return _earlier(recording, rows)


def _fitted(recording: Recording, effects: Sequence[type[Effect]], known: ModelFile | None) -> tuple[float, float]:
    """Error of the base model [sensor noise], and when the joint that is read last is read [rows after its stamp]."""
    shooting, noise = Shooting(recording, effects), noise_with_links(recording)
    base = Division(shooting, recording, recording, noise, known=known, segments=SEGMENTS).fit_base()
    return base.error, float(base.fit.model.constants["reading_delay"].max() / recording.step)


def _earlier(recording: Recording, rows: int) -> Recording:
    return recording.with_trials([trial.with_earlier_commands(rows) for trial in recording.trials])
