from dataclasses import replace

import numpy as np
import pytest

from tactile_cube.measurement.comparing.error import residuals, summarise
from tactile_cube.measurement.comparing.joint_offsets import fitted_offsets, no_offsets, replay_each
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.parameters import nominal_parameters
from tests.measurement.small_rig import write

STEP = 0.005


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Trials that the nominal model itself "measured", each initialisation with an offset of its own."""
    read = read_recording(write(tmp_path_factory.mktemp("recording")))
    true = {k: np.array([0.04, 0.0]) for k in no_offsets(read)}
    made = replay_each(read, nominal_parameters(read, None), true, "fast", STEP)
    return read.with_trials(
        [replace(t, position=s.position, torque=s.torque) for t, s in zip(read.trials, made, strict=True)]
    )


def test_offsets_go_to_the_true_side_by_what_gravity_does_with_them(recording: Recording) -> None:
    found = fitted_offsets(recording, nominal_parameters(recording, None), STEP)
    for offset in found.values():
        assert 0.01 < offset[0] < 0.06


def test_the_offsets_found_never_make_a_model_follow_worse(recording: Recording) -> None:
    parameters = nominal_parameters(recording, None)

    def error(offsets: dict[int, np.ndarray]) -> float:
        made = replay_each(recording, parameters, offsets, "fast", STEP)
        return summarise(residuals(recording.trials, [one.position for one in made]), recording.joints).overall

    assert error(fitted_offsets(recording, parameters, STEP)) < error(no_offsets(recording))
