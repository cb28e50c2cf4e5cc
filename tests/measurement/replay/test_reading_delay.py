"""Positions that are older or younger than the row that logs them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.replay.nominal import nominal_model
from tactile_cube.measurement.replay.simulator import free_run
from tests.measurement.small_rig import write


@pytest.mark.parametrize("rows", [-0.5, 0.3, 1.0])
def test_a_reading_shows_the_position_of_a_part_of_a_row_before(rows: float, tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    model, delay = nominal_model(recording), rows * recording.step
    late = replace(model, constants={**model.constants, "reading_delay": np.full(2, delay)})
    exact, shown = (free_run(recording, one)[0].position for one in (model, late))
    time = recording.trials[0].time
    expected = np.stack([np.interp(time - delay, time, column) for column in exact.T], axis=1)
    assert np.abs(shown - expected)[2:-2].max() < 0.1 * np.abs(exact - expected)[2:-2].max()
