import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import catalogue, find_effect
from tactile_cube.measurement.replay.read_out import before_steps, free_way, jump_ratio, read_out, spring_ratios
from tests.drivetrain.rigs import wheel


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


KP, STIFFNESS = 3.0, 20.0
PLAIN = KP / (KP + STIFFNESS)
DELAY, LAG = find_effect("command_delay"), find_effect("actuator_lag")
BACKLASH = find_effect("backlash")


@pytest.fixture(scope="module")
def plant() -> Plant:
    return Plant([wheel()], dt=0.002, effects=tuple(catalogue().values()), joint_names=["q"])


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
def test_a_motor_follows_the_command_freely_as_far_as_its_gap_goes(plant, values, lead, jump, free) -> None:
    """A torque of 0.003 N m leads by 0.0015 rad at 2 N m/rad, and by the softness' tanh(1) of half a smooth play."""
    memory, one = memory_of(plant, BACKLASH("q", play=0.0, **values)), np.ones(1)
    assert free_way(plant, memory, jump * one, lead * one, 2.0 * one) == pytest.approx(free, abs=1e-12)


@pytest.mark.filterwarnings("error")
def test_within_a_gap_wider_than_the_probe_the_plain_drives_ratio_holds(plant: Plant) -> None:
    assert position_ratio(plant, BACKLASH("q", play=0.0, gap=0.2)) == pytest.approx(PLAIN)


def test_a_stiffening_spring_jumps_as_its_two_torques_say(plant: Plant) -> None:
    """Torques of deflections d by tau = K d + c d^3 at K = 10 N m/rad; the command leads the joint by tau / kp + d."""
    spring = find_effect("stiffening_elasticity")("q", compliance=1.0 / 10.0 - 1.0 / STIFFNESS, cubic=4e4)
    memory, deflection = memory_of(plant, spring), np.array([[0.004], [0.012], [0.012]])
    torque = 10.0 * deflection + 4e4 * deflection**3
    lead = torque / KP + deflection
    ratios = spring_ratios(plant, memory, lead[1:] - lead[:2], torque[1:], (np.full((1, 1), PLAIN), (1.0 - PLAIN) * KP))
    read, felt = read_out(deflection[1:], torque[1:], lead[1:] - lead[:2], ratios, np.array([100.0]))
    assert read == pytest.approx(deflection[:2])
    assert felt == pytest.approx(torque[:2])


def test_a_plain_drives_ratios_stay(plant: Plant) -> None:
    ratios = np.full((1, 1), 0.1), np.full((1, 1), 2.0)
    assert spring_ratios(plant, memory_of(plant), np.ones((2, 1)), np.ones((2, 1)), ratios) is ratios
