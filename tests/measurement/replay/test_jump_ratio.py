import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.measurement.replay.jump_ratio import free_way, jump_ratio
from tests.drivetrain.rigs import wheel

KP, STIFFNESS = 3.0, 20.0
PLAIN = KP / (KP + STIFFNESS)
DELAY, LAG = find_effect("command_delay"), find_effect("actuator_lag")
BACKLASH = find_effect("backlash")


@pytest.fixture(scope="module")
def plant() -> Plant:
    return Plant([wheel()], dt=0.002, effects=(DELAY, LAG, BACKLASH), joint_names=["q"])


def memory_of(plant: Plant, *effects: object) -> np.ndarray:
    one = np.ones(1)
    constants = DrivetrainConstants(
        kp=KP * one,
        kd=0.2 * one,
        stiffness=STIFFNESS * one,
        static_friction=0.02 * one,
        reflected_inertia=0.003 * one,
        torque_limit=one,
    )
    return plant.memory(constants, gravity=(0.0, 0.0, 0.0), effects=list(effects))


def position_ratio(plant: Plant, *effects: object) -> float:
    memory = memory_of(plant, *effects)
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


@pytest.mark.parametrize("values", [{"gap": 0.02}, {"smooth": 0.02, "softness": 0.003}])
def test_what_a_motor_follows_freely_within_a_gap_is_no_part_of_the_ratio(plant: Plant, values: dict) -> None:
    assert position_ratio(plant, BACKLASH("q", play=0.0, **values)) == pytest.approx(PLAIN)


SMOOTH = {"smooth": 0.02, "softness": 0.003}


@pytest.mark.parametrize(
    ("values", "lead", "jump", "free"),
    [  # beyond a gap of 0.02 rad all the time, within it all the time, coming out of it; crossing a smooth one
        ({"gap": 0.02}, 0.1, 0.05, 0.0),
        ({"gap": 0.02}, 0.001, 0.003, 0.003),
        ({"gap": 0.02}, 0.1, 0.097, 0.007),
        (SMOOTH, 0.003 / 2.0 + 0.01 * np.tanh(1.0), 0.003 / 2.0 + 0.01 * np.tanh(1.0), 0.01 * np.tanh(1.0)),
        (SMOOTH, 0.1, 0.2, 0.02),
    ],
)
def test_a_motor_follows_the_command_freely_as_far_as_its_gap_goes(
    plant: Plant, values: dict, lead: float, jump: float, free: float
) -> None:
    """A torque of 0.003 N m leads by 0.0015 rad at 2 N m/rad, and by the softness' tanh(1) of half a smooth play."""
    memory, one = memory_of(plant, BACKLASH("q", play=0.0, **values)), np.ones(1)
    assert free_way(plant, memory, jump * one, lead * one, 2.0 * one) == pytest.approx(free, abs=1e-12)


@pytest.mark.filterwarnings("error")
def test_within_a_gap_wider_than_the_probe_the_plain_drives_ratio_holds(plant: Plant) -> None:
    assert position_ratio(plant, BACKLASH("q", play=0.0, gap=0.2)) == pytest.approx(PLAIN)
