import numpy as np
import pytest

from tactile_cube.measurement.replay.read_out import before_steps, read_out


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


def test_what_a_motor_follows_freely_jumps_with_the_command() -> None:
    read, torque = read_out(np.zeros((1, 1)), np.zeros((1, 1)), 0.05, (0.1, 2.0), 1.0, 0.007)  # type: ignore[arg-type]
    assert (read[0, 0], torque[0, 0]) == pytest.approx((-0.007 - 0.1 * 0.043, -2.0 * 0.043))


def test_before_a_step_of_the_command_the_row_goes_on_as_it_did() -> None:
    """Two segments of two rows of four steps; the second row of each is the line through the row before."""
    signals = np.array([0.0, 9.0, 1.0, 1.5, 7.0, 7.0, 7.0, 7.0, 0.0, 9.0, 3.0, 2.0, 7.0, 7.0, 7.0, 7.0])
    shown, known = before_steps(signals[None, :, None], segment=2, substeps=4)
    assert shown[0, :, 0].tolist() == [0.0, 2.0, 0.0, 1.0]
    assert known.tolist() == [False, True, False, True]
    assert not before_steps(signals[None, :, None], segment=2, substeps=2)[1].any(), "too few steps for a line"
