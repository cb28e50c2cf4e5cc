from dataclasses import replace
from pathlib import Path

import numpy as np

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.disturbances import in_time
from tactile_cube.measurement.recordings.reading import read_recording
from tests.identification.rigs_of_any_size import EFFECTS, SAMPLES, STEP, Size, simulated

LATE = 3  # rows


def test_commands_logged_late_are_taken_earlier_and_said(tmp_path: Path) -> None:
    clean = simulated(tmp_path, Size(), find_effect("viscous_friction"), {"damping": 0.01})
    said: list[str] = []
    assert in_time(clean, EFFECTS, said.append) is clean
    assert not said

    logged = [np.concatenate([np.repeat(t.command[:1], LATE, axis=0), t.command[:-LATE]]) for t in clean.trials]
    late = clean.with_trials([replace(t, command=c) for t, c in zip(clean.trials, logged, strict=True)])
    found = in_time(late, EFFECTS, said.append)
    for trial, true in zip(found.trials, clean.trials, strict=True):
        assert np.array_equal(trial.command[: SAMPLES - LATE], true.command[: SAMPLES - LATE])
        assert np.flatnonzero(~trial.valid).tolist() == list(range(SAMPLES - LATE, SAMPLES))
    assert f"commands_late: {LATE}" in said[0]
    assert f"{LATE} rows ({1e3 * LATE * STEP:.3g} ms) before its commands" in said[0]


def test_what_was_found_is_written_once_and_read_by_every_command(tmp_path: Path) -> None:
    clean = simulated(tmp_path, Size(), find_effect("viscous_friction"), {"damping": 0.01})
    file = tmp_path / "recording.yaml"
    file.write_text(file.read_text() + f"sensors: {{commands_late: {LATE}}}\n")
    for trial, logged in zip(read_recording(tmp_path).trials, clean.trials, strict=True):
        assert np.array_equal(trial.command[:-LATE], logged.command[LATE:])
        assert np.flatnonzero(~trial.valid).tolist() == list(range(SAMPLES - LATE, SAMPLES))
        assert np.array_equal(trial.position, logged.position)
