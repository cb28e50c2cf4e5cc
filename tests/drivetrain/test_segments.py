"""Multiple shooting: every segment starts where the sensor was."""

import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import Effect
from tactile_cube.drivetrain.effects.motor import TorqueBias
from tactile_cube.drivetrain.effects.transmission import Backlash, PositionOffset
from tactile_cube.drivetrain.signals import MOTOR_POSITION
from tests.drivetrain.rigs import wheel

SOFT = DrivetrainConstants(kp=2.0, kd=0.1, stiffness=20.0, static_friction=0.0, reflected_inertia=1e-3)
ROWS, SEGMENT, DT = 60, 20, 2e-3


def readings(effect: Effect, command: np.ndarray, starts: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Readings (60,) [rad] of a wheel's sensor in three segments."""
    plant = Plant([wheel()], dt=DT, effects=(PositionOffset, Backlash, TorqueBias))
    memory = plant.memory(SOFT, effects=[effect])[None]
    plant.reset(memory, starts[0], speeds[0])
    out = np.zeros((1, ROWS, 1, 1))
    plant.kernel.segments_batch(
        command[None, :, None], np.array([0]), np.array([ROWS]), 0, 1, SEGMENT, starts[None, :, None],
        speeds[None, :, None], np.zeros((1, 2)), np.zeros((1, 2)), memory,
        np.zeros((1, 1)), np.array([MOTOR_POSITION]), 0, 1, out,
    )  # fmt: skip
    found: np.ndarray = out[0, :, 0, 0]
    return found


def sensor(error: float) -> np.ndarray:
    """Readings of a wheel that goes to 0.1 rad by a sensor whose zero is wrong, less that error."""
    starts = error + 0.02 * np.arange(3)  # all that a user knows of a start is what the sensor said
    return readings(PositionOffset("q", offset=error), np.full(ROWS, 0.1 + error), starts, np.zeros(3)) - error


@pytest.mark.parametrize("error", [0.1, -0.3])
def test_a_wrong_zero_of_the_sensor_moves_no_start(error: float) -> None:
    assert sensor(error) == pytest.approx(sensor(0.0), abs=5e-5)


def test_a_joint_stands_where_an_added_torque_and_its_controller_balance_from_the_first_step_on() -> None:
    rest = 0.2 / SOFT.kp
    seen = readings(TorqueBias("q", bias=0.2), np.zeros(ROWS), np.full(3, rest), np.zeros(3))
    assert seen == pytest.approx(np.full(ROWS, rest), abs=1e-5)


def test_a_joint_that_its_sensor_does_not_show_goes_on_through_the_start_of_a_segment() -> None:
    """A wheel rolls freely while its motor runs along in the gap; every later measured speed says that it stands."""
    motor = 0.5 * DT * np.arange(ROWS)
    seen = readings(Backlash("q", gap=0.02), motor + 0.1 / 2.0 * 0.5, motor[::SEGMENT], np.array([0.5, 0.0, 0.0]))
    assert seen == pytest.approx(motor, abs=1e-9)
