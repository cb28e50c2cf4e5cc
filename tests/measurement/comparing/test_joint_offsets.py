from dataclasses import replace

import numpy as np
import pytest

from tactile_cube.measurement.comparing.error import free_run_error
from tactile_cube.measurement.comparing.joint_offsets import with_fitted_offsets
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.nominal import nominal_model
from tactile_cube.measurement.replay.simulator import Simulator, free_run
from tests.measurement.small_rig import write

STEP = 0.005


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Trials that the nominal model itself "measured", each initialisation with an offset of its own."""
    read = read_recording(write(tmp_path_factory.mktemp("recording")))
    nominal = nominal_model(read)
    true = {key: np.array([0.04, 0.0]) for key in nominal.offsets}
    made = free_run(read, replace(nominal, offsets=true), step=STEP)
    return read.with_trials(
        [replace(t, position=s.position, torque=s.torque) for t, s in zip(read.trials, made, strict=True)]
    )


def test_offsets_go_to_the_true_side_by_what_gravity_does_with_them(recording: Recording) -> None:
    found = with_fitted_offsets(Simulator(recording, step=STEP), nominal_model(recording))
    for offset in found.offsets.values():
        assert 0.01 < offset[0] < 0.06


def test_the_offsets_found_never_make_a_model_follow_worse(recording: Recording) -> None:
    simulator, nominal = Simulator(recording, step=STEP), nominal_model(recording)
    before, after = simulator.free_runs([nominal, with_fitted_offsets(simulator, nominal)])
    assert free_run_error(recording, after).overall < free_run_error(recording, before).overall
