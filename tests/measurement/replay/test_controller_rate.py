from pathlib import Path

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.nominal import nominal_model
from tactile_cube.measurement.replay.simulator import free_run
from tests.measurement.small_rig import write


def recording(folder: Path, rate: float | None) -> Recording:
    def change(data: dict) -> None:
        if rate is not None:
            data["controller"]["rate_hz"] = rate

    return read_recording(write(folder, change))


def simulated(folder: Path, rate: float | None, step: float) -> np.ndarray:
    one = recording(folder, rate)
    return np.concatenate([trial.position for trial in free_run(one, nominal_model(one), step=step)])


def test_the_law_runs_at_the_controllers_rate_whatever_the_simulations_step(tmp_path: Path) -> None:
    often = simulated(tmp_path / "often", 1000, step=0.01)
    assert np.array_equal(often, simulated(tmp_path / "small", None, step=0.001))
    assert np.abs(often - simulated(tmp_path / "log", None, step=0.01)).max() > 1e-4


def test_by_default_the_controller_is_as_fast_as_the_log(tmp_path: Path) -> None:
    assert recording(tmp_path / "a", None).substeps(0.01) == 1
    assert recording(tmp_path / "b", 100).substeps(0.01) == 1
    assert recording(tmp_path / "c", 1000).substeps(0.01) == 10
    assert recording(tmp_path / "d", 1000).substeps(0.0005) == 20


def test_a_controller_slower_than_the_log_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"key 'controller\.rate_hz': received 50, below"):
        recording(tmp_path, 50)
