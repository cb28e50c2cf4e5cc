from pathlib import Path

import numpy as np
import polars as pl

from tactile_cube.identification.next_experiment import FASTEST, Experiment, safe_excitations
from tactile_cube.measurement.recordings.reading import read_recording
from tests.measurement.small_rig import write


def test_commands_stay_within_positions_and_speeds_that_were_safe(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    shown = np.concatenate([trial.command for trial in recording.trials])
    fastest = max(np.abs(np.diff(trial.command, axis=0)).max() for trial in recording.trials)
    for name, commands in safe_excitations(recording, 0).items():
        assert (commands >= shown.min(axis=0) - 1e-9).all(), name
        assert (commands <= shown.max(axis=0) + 1e-9).all(), name
        assert np.abs(np.diff(commands, axis=0)).max() <= FASTEST * fastest + 1e-9, name


def test_the_command_file_has_the_columns_of_a_recording(tmp_path: Path) -> None:
    time = np.arange(3) * 0.01
    experiment = Experiment("slow triangles", ("a", "b"), time, np.ones((3, 2)), 1e-3, "a", {})
    table = pl.read_csv(experiment.write(tmp_path))
    assert table.columns == ["time", "a.command", "b.command"]
    assert table["b.command"].to_list() == [1.0, 1.0, 1.0]
