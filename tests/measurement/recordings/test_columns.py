from pathlib import Path

import numpy as np
import pytest

from tactile_cube.measurement.recordings import columns as outliers
from tactile_cube.measurement.recordings.reading import read_recording
from tests.measurement.small_rig import write

ROWS, SIZE = (40, 41, 170), 0.05


def test_single_readings_that_are_nonsense_are_bridged_said_and_count_in_no_error(tmp_path: Path) -> None:
    def spoil(columns: dict[str, np.ndarray]) -> None:
        columns["a.position"][list(ROWS)] += np.array([SIZE, -SIZE, SIZE])

    clean = read_recording(write(tmp_path / "clean"))
    spoiled = read_recording(write(tmp_path / "spoiled", spoil=spoil))
    trial = spoiled.trials[0]
    assert np.flatnonzero(~trial.valid).tolist() == list(ROWS)
    assert np.abs(trial.position - clean.trials[0].position).max() < 0.15 * SIZE
    (line,) = [one for one in spoiled.warnings if "single readings" in one][:1]
    assert "a.position" in line
    assert f"first in row {ROWS[0]}" in line


def test_steps_and_quick_turns_of_the_motion_are_no_outliers(tmp_path: Path) -> None:
    def jerky(columns: dict[str, np.ndarray]) -> None:
        time = columns["time"]
        columns["a.position"][:] = 0.3 * np.sign(np.sin(8.0 * time)) + 0.1 * np.abs(np.sin(30.0 * time))

    assert read_recording(write(tmp_path, spoil=jerky)).trials[0].valid.all()


def test_readings_too_many_to_search_are_no_single_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def spoil(columns: dict[str, np.ndarray]) -> None:
        columns["a.position"][list(ROWS)] += SIZE

    monkeypatch.setattr(outliers, "MANY", 2)
    assert read_recording(write(tmp_path, spoil=spoil)).trials[0].valid.all()
