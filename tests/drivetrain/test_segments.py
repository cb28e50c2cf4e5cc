"""Multiple shooting: every segment starts where the sensor was."""

import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects.position_offset import PositionOffset
from tactile_cube.drivetrain.signals import MOTOR_POSITION
from tests.drivetrain.rigs import wheel

SOFT = DrivetrainConstants(kp=2.0, kd=0.1, stiffness=20.0, static_friction=0.0, reflected_inertia=1e-3)
ROWS, SEGMENT = 60, 20


def sensor(error: float) -> np.ndarray:
    """Readings (60,) [rad] of a wheel that goes to 0.1 rad by a sensor whose zero is wrong, less that error."""
    plant = Plant([wheel()], dt=2e-3, effects=(PositionOffset,))
    memory = plant.memory(SOFT, effects=[PositionOffset("q", offset=error)])[None]
    plant.reset(memory, error)  # all that a user knows of the start is what the sensor said
    out = np.zeros((1, ROWS, 1, 1))
    position = error + 0.02 * np.arange(ROWS // SEGMENT)[None, :, None]
    commands = np.full((1, ROWS, 1), 0.1 + error)
    plant.kernel.segments_batch(
        commands, np.array([0]), np.array([ROWS]), 0, 1, SEGMENT, position, np.zeros_like(position), np.zeros((1, 2)),
        np.zeros((1, 2)), memory, np.array([MOTOR_POSITION]), 0, 1, out,
    )  # fmt: skip
    readings: np.ndarray = out[0, :, 0, 0] - error
    return readings


@pytest.mark.parametrize("error", [0.1, -0.3])
def test_a_wrong_zero_of_the_sensor_moves_no_start(error: float) -> None:
    assert sensor(error) == pytest.approx(sensor(0.0), abs=5e-5)
