"""A motor in the gap of its transmission carries no torque and stands where its controller asks for none."""

import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects.backlash import Backlash
from tactile_cube.drivetrain.signals import MOTOR_POSITION, ROWS, TORQUE
from tests.drivetrain.rigs import wheel

KP, KD, STIFFNESS, GAP, DT = 3.0, 0.2, 20.0, 0.02, 2e-3
SLOPE = KP / (1.0 + KP / STIFFNESS)


def plant_and_memory(friction: float, **values: float) -> tuple[Plant, np.ndarray]:
    plant = Plant([wheel()], dt=DT, effects=(Backlash,))
    constants = DrivetrainConstants(
        kp=KP, kd=KD, stiffness=STIFFNESS, static_friction=friction, reflected_inertia=1e-3, torque_limit=1.0
    )
    return plant, plant.memory(constants, effects=[Backlash("q", **values)])


@pytest.mark.parametrize(
    ("command", "torque"), [(0.004, 0.0), (-0.009, 0.0), (0.03, SLOPE * 0.02), (-0.05, -SLOPE * 0.04)]
)
def test_a_held_joint_feels_only_what_goes_beyond_the_gap(command: float, torque: float) -> None:
    plant, memory = plant_and_memory(friction=1.0, play=0.0, gap=GAP)
    plant.reset(memory, 0.0)
    plant.kernel.step(np.array([command]), memory)
    lead = np.clip(command, -0.5 * GAP, 0.5 * GAP)
    assert plant.signal(memory, TORQUE)[0] == pytest.approx(torque, abs=1e-12)
    assert plant.signal(memory, MOTOR_POSITION)[0] == pytest.approx(lead + torque / STIFFNESS, abs=1e-12)


def test_a_gap_full_of_oil_is_crossed_in_a_while_and_pulls_meanwhile() -> None:
    plant, memory = plant_and_memory(friction=1.0, play=0.0, gap=GAP, crossing=20 * DT)
    plant.reset(memory, 0.0)
    leads, command = [], 0.008
    for _ in range(40):
        plant.kernel.step(np.array([command]), memory)
        torque = plant.signal(memory, TORQUE)[0]
        leads.append(plant.signal(memory, MOTOR_POSITION)[0] - torque / STIFFNESS)
        assert torque == pytest.approx(SLOPE * (command - leads[-1]), abs=1e-12)
    assert leads[19] == pytest.approx(command * (1.0 - np.exp(-1.0)))
    assert leads[39] == pytest.approx(command * (1.0 - np.exp(-2.0)))


@pytest.mark.parametrize("command", [0.05, -0.03])
def test_a_smooth_backlash_leads_by_half_of_it_on_either_flank(command: float) -> None:
    plant, memory = plant_and_memory(friction=1.0, play=0.0, smooth=GAP, softness=0.002)
    plant.reset(memory, 0.0)
    readings = []
    for _ in range(20):
        plant.kernel.step(np.array([command]), memory)
        readings.append(plant.signal(memory, MOTOR_POSITION)[0])
    lead = np.copysign(0.5 * GAP, command)
    torque = KP * (command - readings[-1])
    assert readings[-1] == pytest.approx(lead + torque / STIFFNESS, abs=1e-6)
    assert readings[-1] == pytest.approx(readings[-2], abs=1e-9), "what the torque deflects, the torque feels at once"


def test_a_play_keeps_the_reading_until_the_joint_has_moved_through_it() -> None:
    state = np.zeros(Backlash.state_size(DT))
    readings = []
    for q in (0.0, 0.03, 0.02, 0.01, 0.0):
        x = np.zeros((ROWS, 1))
        x[MOTOR_POSITION, 0] = q
        readings.append(Backlash.law(x, 0, np.array([GAP, 0.0, 0.0, 0.01, 0.0]), state, DT))
    assert readings == pytest.approx([0.0, 0.02, 0.02, 0.02, 0.01])


def test_a_joint_that_its_sensor_does_not_show_goes_on_through_the_start_of_a_segment() -> None:
    """A wheel rolls freely while its motor runs along in the gap; every measured start speed says that it stands."""
    plant, memory = plant_and_memory(friction=0.0, play=0.0, gap=GAP)
    rows, segment, speed = 90, 30, 0.5
    commands = (speed * DT * np.arange(rows) + KD / KP * speed)[None, :, None]
    motor = speed * DT * np.arange(rows)
    plant.reset(memory, 0.0, speed)
    out = np.zeros((1, rows, 1, 1))
    starts = motor[None, ::segment, None]
    speeds = np.array([speed, 0.0, 0.0])[None, :, None]
    plant.kernel.segments_batch(
        commands, np.array([0]), np.array([rows]), 0, 1, segment, starts, speeds, np.zeros((1, 2)), np.zeros((1, 2)),
        memory[None], np.array([MOTOR_POSITION]), 0, 1, out,
    )  # fmt: skip
    assert out[0, :, 0, 0] == pytest.approx(motor, abs=1e-9)
