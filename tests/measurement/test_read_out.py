import numpy as np
import pytest

from tactile_cube.measurement.read_out import half_jumps, impulses, read_out


def test_the_next_command_is_not_felt_yet() -> None:
    """One joint at rest at q = 0: half of a command step of 0.1 rad is in the simulation and none of it in the log."""
    stiffness, jump = 20.0, np.array([[0.05]])
    slope = np.array([3.0 * stiffness / (3.0 + stiffness)])
    torque = slope * jump
    position, felt = read_out(torque / stiffness, torque, jump, (slope / stiffness, slope), np.array([1.0]))
    assert felt == pytest.approx(0.0)
    assert position == pytest.approx(0.0)


def test_a_rigid_drive_moves_only_with_its_link() -> None:
    position = np.array([[0.1], [0.2]])
    jump = np.array([[0.5], [0.4]])
    read, _ = read_out(position, np.zeros((2, 1)), jump, (np.zeros(1), np.array([3.0])), np.array([1.0]))
    assert read[:, 0].tolist() == [0.1, 0.2]


def test_a_torque_at_its_limit_does_not_jump() -> None:
    torque = np.array([[1.0]])
    _, felt = read_out(torque, torque, np.array([[5.0]]), (np.array([0.1]), np.array([2.6])), np.array([1.0]))
    assert felt[0, 0] == 1.0


@pytest.mark.parametrize("substeps", [2, 5])
def test_the_first_step_of_a_row_takes_the_mean_of_two_commands(substeps: int) -> None:
    command = np.array([[0.0], [1.0], [3.0]])
    fine = impulses(command, substeps)
    assert fine[::substeps, 0].tolist() == [0.0, 0.5, 2.0]
    assert fine[1::substeps, 0].tolist() == [0.0, 1.0, 3.0]
    assert half_jumps(fine, substeps)[:, 0].tolist() == [0.0, 0.5, 1.0]
