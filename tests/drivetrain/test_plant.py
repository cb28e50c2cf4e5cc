"""The compiled step as a whole, against what can be worked out by hand."""

import math

import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import ACCELERATION, COMMAND, MOTOR_POSITION, POSITION, TIME, TORQUE, VELOCITY
from tactile_cube.drivetrain.effects.command import CommandDelay
from tactile_cube.drivetrain.effects.friction import StribeckFriction
from tactile_cube.errors import InputError
from tests.drivetrain.effects.laws import CableDrag, HeavyTip
from tests.drivetrain.rigs import finger, pendulum, wheel

EFFECTS = (CommandDelay, StribeckFriction, CableDrag, HeavyTip)
ROWS = np.array([MOTOR_POSITION, POSITION, VELOCITY, TORQUE])
FREE = DrivetrainConstants(kp=0.0, kd=0.0, static_friction=0.0, reflected_inertia=0.0)
SMOOTH = DrivetrainConstants(kp=2.0, kd=0.05, stiffness=20.0, static_friction=0.0, reflected_inertia=1e-3)


def roll(plant: Plant, memory: np.ndarray, commands: np.ndarray, substeps: int = 1, history: int = 0) -> np.ndarray:
    out = np.zeros((len(commands) - history, len(ROWS), commands.shape[1]))
    plant.kernel.rollout(np.ascontiguousarray(commands), history, substeps, memory, ROWS, out)
    return out


def waves(rows: int, joints: int = 3) -> np.ndarray:
    t = np.arange(rows)[:, None] * 0.002
    return 0.3 + 0.4 * np.sin((4.0 + np.arange(joints)) * t)


# --- closed forms ----------------------------------------------------------------------------------------------------


def test_impedance_makes_a_damped_oscillation_of_the_analytic_shape() -> None:
    plant = Plant([wheel(4e-3)], dt=1e-4)
    memory = plant.memory(SMOOTH)
    plant.reset(memory, 0.2)
    q = roll(plant, memory, np.zeros((5000, 1)))[:, 1, 0]
    gain, inertia = 1.0 / (1.0 + 2.0 / 20.0), 5e-3
    decay = 0.05 * gain / (2 * inertia)
    ringing = math.sqrt(2.0 * gain / inertia - decay**2)
    t = np.arange(5000) * 1e-4
    exact = 0.2 * np.exp(-decay * t) * (np.cos(ringing * t) + decay / ringing * np.sin(ringing * t))
    assert np.max(np.abs(q - exact)) < 2e-4


def test_a_free_pendulum_swings_with_its_period() -> None:
    plant = Plant([pendulum(length=0.1)], dt=1e-4)
    memory = plant.memory(FREE)
    plant.reset(memory, 0.01)
    q = roll(plant, memory, np.zeros((20000, 1)))[:, 1, 0]
    crossings = np.flatnonzero(np.diff(np.sign(q)))
    period = 2e-4 * np.mean(np.diff(crossings))
    assert period == pytest.approx(2 * math.pi * math.sqrt(0.1 / 9.81), rel=1e-3)


def test_sliding_friction_slows_at_a_constant_rate_and_then_holds_exactly() -> None:
    plant = Plant([wheel(4e-3)], dt=1e-3)
    memory = plant.memory(DrivetrainConstants(kp=0.0, kd=0.0, static_friction=0.02, reflected_inertia=1e-3))
    plant.reset(memory, 0.0, v=1.0)
    v = roll(plant, memory, np.zeros((400, 1)))[:, 2, 0]
    t = np.arange(400) * 1e-3
    np.testing.assert_allclose(v, np.maximum(1.0 - 0.02 / 5e-3 * t, 0.0), atol=1e-9)
    assert np.all(v[260:] == 0.0)


def test_a_joint_pushed_with_less_than_its_friction_does_not_move_by_a_bit() -> None:
    plant = Plant([finger()], dt=0.002)
    memory = plant.memory(DrivetrainConstants(static_friction=0.3))
    plant.reset(memory, (0.1, 0.4, 0.2))
    q = roll(plant, memory, np.tile([0.1, 0.45, 0.2], (500, 1)))[:, 1]
    assert np.all(q == np.array([0.1, 0.4, 0.2]))


def test_creeping_friction_creeps_with_its_rate() -> None:
    plant = Plant([wheel()], dt=0.002)
    memory = plant.memory(DrivetrainConstants(kp=0.0, kd=0.0))
    plant.view(memory, "external_torque")[:] = 0.01
    plant.view(memory, "friction_creep")[:] = 0.05
    plant.kernel.rollout(np.zeros((200, 1)), 0, 1, memory, ROWS, np.zeros((200, 4, 1)))
    assert plant.view(memory, "v")[0] == pytest.approx(0.01 * 0.05, rel=1e-9)


@pytest.mark.parametrize(("sign", "side"), [("physical", 1.0), ("printed", -1.0)])
def test_motor_is_ahead_of_the_link_by_the_torque_over_the_stiffness(sign, side) -> None:
    plant = Plant([wheel()], dt=0.002)
    memory = plant.memory(DrivetrainConstants(sign=sign, torque_limit=0.5))
    out = roll(plant, memory, np.ones((5, 1)))
    np.testing.assert_allclose(out[:, 0] - out[:, 1], side * out[:, 3] / 25.0, rtol=1e-12)
    assert out[0, 3, 0] == 0.5


def test_a_known_force_at_a_clamped_joint_shifts_only_the_motor() -> None:
    plant = Plant([wheel()], dt=0.002)
    memory = plant.memory(DrivetrainConstants())
    plant.view(memory, "brake")[:] = 1e9
    out = roll(plant, memory, np.full((50, 1), 0.1))
    assert np.all(out[:, 1] == 0.0)
    torque = 3.69 * 0.1 / (1 + 3.69 / 25)
    assert out[-1, 0, 0] == pytest.approx(torque / 25)


def test_statics_under_gravity_and_a_load_balance() -> None:
    plant = Plant([pendulum(length=0.1, mass=0.2)], dt=0.001)
    memory = plant.memory(DrivetrainConstants(static_friction=0.0, stiffness=np.inf, reflected_inertia=2e-3))
    plant.view(memory, "external_torque")[:] = -0.05
    q = roll(plant, memory, np.full((4000, 1), 0.5))[-1, 1, 0]
    assert 3.69 * (0.5 - q) == pytest.approx(0.2 * 9.81 * 0.1 * math.sin(q) + 0.05, abs=1e-9)


def test_smaller_steps_converge() -> None:
    errors, finest = [], None
    for substeps in (32, 4, 2, 1):
        plant = Plant([finger()], dt=0.004 / substeps)
        memory = plant.memory(SMOOTH, gravity=(0.5, 1.0, -9.81))
        plant.view(memory, "reading")[...] = 0
        plant.reset(memory, (0.5, 0.3, 0.2))
        q = roll(plant, memory, np.full((100, 3), 0.3), substeps)[:, 1]
        finest = q if finest is None else finest
        errors.append(np.sqrt(np.mean((q - finest) ** 2)))
    assert errors[3] < 2e-3
    assert errors[1] < 0.6 * errors[2] < 0.36 * errors[3]


# --- memory ----------------------------------------------------------------------------------------------------------


def test_a_restored_snapshot_continues_bit_for_bit() -> None:
    effects = [CommandDelay("q1", delay=0.017), StribeckFriction("q3", excess=0.05)]
    plant = Plant([finger()], dt=0.002, effects=EFFECTS)
    memory = plant.memory(DrivetrainConstants(), effects=effects)
    commands = waves(400)
    roll(plant, memory, commands[:200])
    snapshot = memory.copy()
    first = roll(plant, memory, commands[200:])
    memory[:] = snapshot
    assert np.array_equal(roll(plant, memory, commands[200:]), first)


def test_a_reset_forgets_everything_but_the_constants() -> None:
    plant = Plant([finger()], dt=0.002, effects=EFFECTS)
    memory = plant.memory(DrivetrainConstants(), effects=[CommandDelay("q1", delay=0.017)])
    commands = waves(200)
    first = roll(plant, memory, commands)
    plant.reset(memory, np.zeros(3))
    assert np.array_equal(roll(plant, memory, commands), first)


def test_history_fills_what_effects_remember_without_moving_the_joints() -> None:
    plant = Plant([finger()], dt=0.002, effects=EFFECTS)
    memory = plant.memory(DrivetrainConstants(), effects=[CommandDelay("q1", delay=0.02)])
    commands = np.concatenate([np.full((20, 3), 0.3), np.full((5, 3), 0.9)])
    roll(plant, memory, commands, history=20)
    assert plant.signal(memory, COMMAND).tolist() == pytest.approx([0.3, 0.9, 0.9])
    assert plant.signal(memory, TIME)[0] == pytest.approx(4 * 0.002)


def test_a_row_is_read_at_its_last_substep_unless_told_otherwise() -> None:
    plant = Plant([wheel()], dt=0.0005)
    memory = plant.memory(DrivetrainConstants(reflected_inertia=2e-3))
    commands = np.ones((50, 1))
    every = roll(plant, memory.copy(), np.repeat(commands, 4, axis=0))
    assert np.array_equal(roll(plant, memory.copy(), commands, 4), every[3::4])
    plant.view(memory, "reading")[...] = 1
    assert np.array_equal(roll(plant, memory, commands, 4), every[1::4])


def test_chains_are_independent_of_each_other() -> None:
    plant = Plant([finger(), finger(distal_mass=0.1)], dt=0.002)
    memory = plant.memory(DrivetrainConstants(), gravity=((0, 0, -9.81), (0, 3.0, -9.0)))
    both = roll(plant, memory, np.tile(waves(200), 2))
    for c, (tree, gravity) in enumerate(((finger(), (0, 0, -9.81)), (finger(0.1), (0, 3.0, -9.0)))):
        one = Plant([tree], dt=0.002)
        alone = roll(one, one.memory(DrivetrainConstants(), gravity=gravity), waves(200))
        assert np.array_equal(both[:, :, 3 * c : 3 * c + 3], alone)


# --- effects ---------------------------------------------------------------------------------------------------------


def test_effect_values_may_be_a_batch() -> None:
    plant = Plant([finger()], dt=0.002, effects=EFFECTS)
    memory = np.tile(plant.memory(DrivetrainConstants()), (2, 1))
    plant.set_effect(memory, HeavyTip, "q3", {"mass": np.array([0.0, 0.1])})
    plant.set_effect(memory, CableDrag, "q1", {"stiffness": np.array([0.2, 0.3]), "drag": 0.0})
    assert plant.view(memory, "mass")[:, 0, 2].tolist() == pytest.approx([0.055, 0.155])
    assert plant.view(memory, "parameters:cable_drag")[:, 0].tolist() == [[0.2, 0.0], [0.3, 0.0]]


def test_what_a_law_sees_is_what_happened() -> None:
    plant = Plant([finger()], dt=0.002)
    memory = plant.memory(DrivetrainConstants())
    roll(plant, memory, waves(50))
    before = plant.view(memory, "v").copy()
    plant.kernel.step(np.array([0.5, 0.5, 0.5]), memory)
    assert np.array_equal(plant.signal(memory, VELOCITY), before)
    np.testing.assert_allclose(plant.signal(memory, ACCELERATION) * 0.002, plant.view(memory, "v") - before, atol=1e-12)
    assert plant.signal(memory, COMMAND).tolist() == [0.5] * 3


# --- wrong input -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: Plant([finger()], dt=0.0), "dt is 0"),
        (lambda: Plant([finger(), wheel()], dt=0.002), "equal structure"),
        (lambda: Plant([finger()], dt=0.002, joint_names=["a"]), "1 joint names for 3"),
        (lambda: Plant([finger()], dt=0.002).memory(DrivetrainConstants(kp=(1.0, 2.0))), "kp has 2 values for 3"),
        (
            lambda: Plant([finger()], dt=0.002).memory(DrivetrainConstants(), effects=[CableDrag("q1")]),
            "'cable_drag' is not among",
        ),
        (
            lambda: Plant([finger()], dt=0.002, effects=[CableDrag]).memory(
                DrivetrainConstants(), effects=[CableDrag("q7")]
            ),
            "'q7' is unknown",
        ),
    ],
)
def test_what_does_not_fit_is_refused(make, complaint) -> None:
    with pytest.raises(InputError, match=complaint):
        make()
