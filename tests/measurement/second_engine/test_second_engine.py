"""A finger that MuJoCo moved (make.py, true constants stated) against free runs of the package."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.simulator import free_run

BOUND = 2e-4  # [rad] RMS of each joint in each trial
TORQUE_BOUND = 5e-3  # [N m]


@pytest.fixture(scope="module")
def recording() -> Recording:
    return read_recording(Path(__file__).parent / "finger")


def errors(recording: Recording, step: float, **changed: float) -> np.ndarray:
    """RMS (trials, 2, joints) of position [rad] and torque [N m] with constants multiplied by factors."""
    nominal = nominal_model(recording)
    constants = {name: changed.get(name, 1.0) * value for name, value in nominal.constants.items()}
    rows = []
    for trial, run in zip(
        recording.trials, free_run(recording, replace(nominal, constants=constants), step), strict=True
    ):
        assert trial.torque is not None
        pairs = (run.position - trial.position, run.torque - trial.torque)
        rows.append([np.sqrt(np.square(difference).mean(axis=0)) for difference in pairs])
    return np.array(rows)


@pytest.mark.parametrize("step", [2e-3, 5e-4])
def test_a_free_run_follows_a_finger_of_another_engine(recording: Recording, step: float) -> None:
    position, torque = errors(recording, step).transpose(1, 0, 2)
    assert position.max() < BOUND, f"{1e3 * position} mrad"
    assert torque.max() < TORQUE_BOUND, f"{torque} N m"
    assert all(np.ptp(trial.position, axis=0).min() > 0.3 for trial in recording.trials), "every joint moves far"


@pytest.mark.parametrize(
    "wrong", [{"static_friction": 0.8}, {"reflected_inertia": 1.2}, {"kd": 1.05}, {"stiffness": 0.85}]
)
def test_the_bound_tells_a_slightly_wrong_constant(recording: Recording, wrong: dict[str, float]) -> None:
    assert errors(recording, 2e-3, **wrong)[:, 0].max() > BOUND


def test_the_script_writes_what_is_committed(recording: Recording) -> None:
    pytest.importorskip("mujoco")
    from tests.measurement.second_engine import make

    for trial in recording.trials:
        command = np.round(make.commands(trial.kind), 6)
        np.testing.assert_allclose(trial.command, command, atol=1e-9)
        position, torque = make.move(make.finger(), command[:50])
        np.testing.assert_allclose(position, trial.position[:50], atol=1e-5)
        np.testing.assert_allclose(torque, trial.torque[:50], atol=1e-4)
