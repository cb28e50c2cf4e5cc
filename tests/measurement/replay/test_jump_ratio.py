import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.measurement.replay.jump_ratio import jump_ratio
from tests.drivetrain.rigs import wheel

KP, STIFFNESS = 3.0, 20.0
PLAIN = KP / (KP + STIFFNESS)
DELAY, LAG = find_effect("command_delay"), find_effect("actuator_lag")
BACKLASH = find_effect("backlash")


@pytest.fixture(scope="module")
def plant() -> Plant:
    return Plant([wheel()], dt=0.002, effects=(DELAY, LAG, BACKLASH), joint_names=["q"])


def position_ratio(plant: Plant, *effects: object) -> float:
    one = np.ones(1)
    constants = DrivetrainConstants(
        kp=KP * one,
        kd=0.2 * one,
        stiffness=STIFFNESS * one,
        static_friction=0.02 * one,
        reflected_inertia=0.003 * one,
        torque_limit=one,
    )
    memory = plant.memory(constants, gravity=(0.0, 0.0, 0.0), effects=list(effects))
    before = memory.copy()
    ratio = jump_ratio(plant, memory, np.zeros(1))[0]
    assert np.array_equal(memory, before)
    return float(ratio[0])


def test_a_plain_drive_deflects_at_once(plant: Plant) -> None:
    assert position_ratio(plant) == pytest.approx(PLAIN)


def test_a_lag_lets_a_part_of_the_jump_pass(plant: Plant) -> None:
    assert 0.0 < position_ratio(plant, LAG("q", time_constant=0.01)) < 0.2 * PLAIN


def test_behind_a_delay_the_jump_comes_later_but_as_large(plant: Plant) -> None:
    assert position_ratio(plant, DELAY("q", delay=0.02)) == pytest.approx(PLAIN)


def test_what_a_motor_follows_freely_within_a_gap_is_no_part_of_the_ratio(plant: Plant) -> None:
    assert position_ratio(plant, BACKLASH("q", play=0.0, gap=0.02)) == pytest.approx(PLAIN)


@pytest.mark.filterwarnings("error")
def test_within_a_gap_wider_than_the_probe_the_plain_drives_ratio_holds(plant: Plant) -> None:
    assert position_ratio(plant, BACKLASH("q", play=0.0, gap=0.2)) == pytest.approx(PLAIN)
