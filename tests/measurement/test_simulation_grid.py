from pathlib import Path

import numpy as np
import pytest

from tactile_cube.measurement.parameters import nominal_parameters
from tactile_cube.measurement.recording import read_recording
from tactile_cube.measurement.replay import replay
from tactile_cube.measurement.simulation_grid import on_simulation_grid
from tests.measurement.small_rig import write


def test_a_recording_on_the_grid_comes_back_as_it_is(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    assert on_simulation_grid(recording, step=0.01) is recording


def test_commands_are_held_and_only_measured_rows_stay_valid(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    fine = on_simulation_grid(recording, step=0.002)
    before, after = recording.trials[0], fine.trials[0]
    assert fine.rate == 500.0
    assert np.array_equal(after.command[::5], before.command)
    assert np.array_equal(after.command[4::5], before.command)
    assert np.flatnonzero(after.valid).tolist() == list(range(4, 1500, 5))
    assert np.allclose(after.position[after.valid], before.position)


def test_rows_read_before_their_period_move_to_the_end_of_the_last_one(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["sensors"]["read"] = "before"

    recording = read_recording(write(tmp_path, change))
    fine = on_simulation_grid(recording, step=0.01)
    assert fine.read == "after"
    assert np.allclose(fine.trials[0].position[:-1], recording.trials[0].position[1:])
    assert not fine.trials[0].valid[-1]


@pytest.mark.parametrize("read", ["before", "after"])
def test_the_simulation_is_the_same_on_both_grids(tmp_path: Path, read: str) -> None:
    def change(data: dict) -> None:
        data["sensors"]["read"] = read

    recording = read_recording(write(tmp_path, change))
    fine = on_simulation_grid(recording)
    coarse_run = replay(recording, nominal_parameters(recording, None), "fast", 0.002)[0]
    fine_run = replay(fine, nominal_parameters(fine, None), "fast", 0.002)[0]
    rows = np.flatnonzero(fine.trials[0].valid)
    expected = coarse_run.position[1:] if read == "before" else coarse_run.position
    assert np.abs(fine_run.position[rows] - expected)[20:].max() < 1e-3


def test_commanded_torques_become_positions_of_a_soft_controller(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["controller"] = {"mode": "torque"}

    recording = read_recording(write(tmp_path, change))
    fine = on_simulation_grid(recording)
    assert not fine.torque_controlled
    trial = fine.trials[0]
    torque = trial.gains.kp * (trial.command - trial.position)
    assert np.allclose(torque[::5], recording.trials[0].command, atol=1e-5)
