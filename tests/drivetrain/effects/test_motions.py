"""How a joint moves under each effect: as in MuJoCo where it has the law, else by a closed form of the motion."""

from collections.abc import Callable, Iterator
from functools import cache

import mujoco
import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import COMMAND, JOINT_TORQUE, MOTOR_POSITION, POSITION, TORQUE, VELOCITY, catalogue
from tests.drivetrain.rigs import pendulums

DT, STEPS = 1e-4, 3000
T = DT * np.arange(STEPS)
SEEN = (POSITION, VELOCITY, MOTOR_POSITION, TORQUE, COMMAND, JOINT_TORQUE)
INERTIA = 5e-3  # [kg m^2] of each joint with its rotor; `c` moves 4e-3 more
FREE = {"kp": 0.0, "kd": 0.0, "stiffness": np.inf, "static_friction": 0.0, "reflected_inertia": 1e-3}
FREE |= {"torque_limit": np.inf}
KP, KD, STIFFNESS = 3.0, 0.2, 20.0
SERVO = FREE | {"kp": KP, "kd": KD}
ELASTIC = SERVO | {"stiffness": STIFFNESS}
Pairs = Iterator[tuple[np.ndarray, np.ndarray | float, float]]
"""Seen, expected and how far apart they may be."""
CLOSED_FORMS: dict[str, Callable[[], Pairs]] = {}


def closed_form(function: Callable[[], Pairs]) -> Callable[[], Pairs]:
    """Registers the closed form of the effect whose name the function has."""
    CLOSED_FORMS[function.__name__] = function
    return function


@cache
def plant() -> Plant:
    return Plant([pendulums()], dt=DT, effects=tuple(catalogue().values()))


def move(
    name: str,
    values: dict[str, float],
    drive: dict[str, float] = FREE,
    command: np.ndarray | float = 0.0,
    q: np.ndarray | float = 0.0,
    v: np.ndarray | float = 0.0,
    load: float = 0.0,
    held: np.ndarray | float = 0.0,
    gravity: float = 0.0,
    joint: str = "b",
) -> dict[int, np.ndarray]:
    """Signals (STEPS,) of a joint with an effect; `held` joints are 1, `load` is a torque from outside [N m]."""
    effect = catalogue()[name]
    neutral = {one.name: one.neutral for one in effect.parameters}
    constants, placed = DrivetrainConstants(**drive), effect(joint, **(neutral | values))
    memory = plant().memory(constants, gravity=(0.0, 0.0, -gravity), effects=[placed])
    plant().view(memory, "external_torque")[:] = load
    plant().view(memory, "brake")[:] = 1e9 * np.asarray(held)
    plant().reset(memory, q, v)
    out = np.zeros((STEPS, len(SEEN), 3))
    commands = np.ascontiguousarray(np.broadcast_to(np.transpose(np.atleast_2d(command)), (STEPS, 3)))
    plant().kernel.rollout(commands, 0, 1, memory, np.array(SEEN), out)
    return dict(zip(SEEN, out[:, :, "abc".index(joint)].T, strict=True))


def push(name: str, values: dict[str, float], torque: float) -> tuple[np.ndarray, np.ndarray]:
    """Speed of a free joint whose controller asks for a constant torque, and time over inertia."""
    drive = FREE | {"kp": 1.0, "torque_limit": abs(torque)}
    return move(name, values, drive, command=1e6 * np.sign(torque))[VELOCITY], T / INERTIA


def linear(matrix: list[list[float]], start: list[float]) -> np.ndarray:
    """First state (STEPS,) of x' = A x."""
    roots, vectors = np.linalg.eig(np.array(matrix))
    return np.real((vectors * np.linalg.solve(vectors, np.array(start, dtype=complex)))[0] @ np.exp(np.outer(roots, T)))


# --- friction --------------------------------------------------------------------------------------------------------


@closed_form
def stribeck_friction() -> Pairs:
    """With an exponent of 1, u = exp(v / vs) decays linearly: u' = -(F u + E) / (J vs)."""
    drive, values = FREE | {"static_friction": 0.02}, {"excess": 0.05, "velocity": 0.3, "exponent": 1.0}
    u = (np.exp(1.0 / 0.3) + 2.5) * np.exp(-0.02 * T / (INERTIA * 0.3)) - 2.5
    yield move("stribeck_friction", values, drive, v=-1.0)[VELOCITY], -0.3 * np.log(np.maximum(u, 1.0)), 1e-3
    yield move("stribeck_friction", values | {"exponent": 2.0}, drive, load=-0.0699)[POSITION], 0.0, 0.0


@closed_form
def load_dependent_friction() -> Pairs:
    for torque in (0.4, -0.4):
        seen, over = push("load_dependent_friction", {"coefficient": 0.2}, torque)
        yield seen, (1.0 - 0.2) * torque * over, 1e-9


@closed_form
def asymmetric_friction() -> Pairs:
    values, drive = {"difference": 0.02, "ratio": 0.3, "friction": 0.01}, FREE | {"static_friction": 0.02}
    for side, friction in ((1.0, 0.04 * 1.3), (-1.0, 0.02 * 0.7)):
        seen = move("asymmetric_friction", values, drive, v=side)[VELOCITY]
        yield seen, side * np.maximum(1.0 - friction * T / INERTIA, 0.0), 1e-9


@closed_form
def friction_drift() -> Pairs:
    drive, values = FREE | {"static_friction": 0.02}, {"change": -0.02, "time_constant": 0.1, "friction": 0.01}
    impulse = (0.03 - 0.02) * T + 0.02 * 0.1 * (1.0 - np.exp(-T / 0.1))
    yield move("friction_drift", values, drive, v=3.0)[VELOCITY], 3.0 - impulse / INERTIA, 3e-4


# --- command and controller ------------------------------------------------------------------------------------------


@closed_form
def rate_limit() -> Pairs:
    command = np.where(T > 0.0, -0.3, 0.0)
    yield move("rate_limit", {"speed": 2.0}, command=command)[COMMAND], np.maximum(-2.0 * T, -0.3), 1e-9


@closed_form
def command_dead_zone() -> Pairs:
    """Where a loaded joint rests, and which command is in force during a ramp."""
    for form, rest in (("error", 0.2 - 0.02 - 0.1), ("gate", 0.2 - 0.1), ("torque", 0.2 - 0.02 / KP - 0.1)):
        values = {form: 0.02}
        yield move("command_dead_zone", values, SERVO, command=0.2, q=rest, load=-0.1 * KP)[POSITION], rest, 1e-9
    ramp = 0.5 * T
    yield move("command_dead_zone", {"play": 0.02}, command=ramp)[COMMAND], np.maximum(ramp - 0.02, 0.0), 1e-9
    held = 0.5 * DT * 101 * (np.arange(STEPS) // 101)
    yield move("command_dead_zone", {"hold": 100.5 * 0.5 * DT}, command=ramp)[COMMAND], held, 1e-9
    # within the gate nothing pulls
    yield move("command_dead_zone", {"gate": 0.5}, SERVO | {"kd": 0.0}, 0.2, v=0.1)[VELOCITY], 0.1, 1e-3


@closed_form
def velocity_filter_lag() -> Pairs:
    lags, start = {"time_constant": 0.004, "second": 0.006}, [0.2, 0.0, 0.0, 0.0]
    law = [[0, 1, 0, 0], [-KP / INERTIA, 0, 0, -KD / INERTIA], [0, 250.0, -250.0, 0], [0, 0, 1 / 0.006, -1 / 0.006]]
    yield move("velocity_filter_lag", lags, SERVO, q=0.2)[POSITION], linear(law, start), 2e-4


@closed_form
def actuator_lag() -> Pairs:
    law = [[0, 1, 0], [0, 0, 1 / INERTIA], [-KP / 0.01, -KD / 0.01, -1 / 0.01]]
    seen = move("actuator_lag", {"time_constant": 0.01}, SERVO, q=0.2)[POSITION]
    yield seen, linear(law, [0.2, 0.0, -0.2 * KP]), 2e-4


@closed_form
def torque_curve() -> Pairs:
    seen, over = push("torque_curve", {"bend": -0.5, "gain": 0.2, "reference": 0.1}, -0.4)
    yield seen, -1.2 * 0.2 * over, 1e-9


@closed_form
def torque_crosstalk() -> Pairs:
    """The neighbours are held and driven with 0.3 and -0.6 N m; the joint gives way to their parts."""
    rest = (0.5 * 0.3 - 0.25 * -0.6) / KP
    command = np.array([0.1, 0.0, -0.2])[:, None] * np.ones(STEPS)
    seen = move(
        "torque_crosstalk",
        {"from_previous": 0.5, "from_next": -0.25},
        SERVO,
        command,
        q=np.array([0.0, rest, 0.0]),
        held=np.array([1.0, 0.0, 1.0]),
    )
    yield seen[POSITION], rest, 1e-9


# --- transmission and sensor -----------------------------------------------------------------------------------------


@closed_form
def elasticity() -> Pairs:
    seen = move("elasticity", {"compliance": 0.05}, ELASTIC, command=0.3, held=1.0)
    torque = KP * 0.3 / (1.0 + KP * (1.0 / STIFFNESS + 0.05))
    yield seen[TORQUE], torque, 1e-12
    yield seen[MOTOR_POSITION], torque * (1.0 / STIFFNESS + 0.05), 1e-12


@closed_form
def stiffening_elasticity() -> Pairs:
    """20 N m/rad and 0.05 rad/(N m) in series are 10 N m/rad."""
    values = {"compliance": 0.05, "cubic": 2e3}
    (deflection,) = (root.real for root in np.roots([2e3, 0.0, 10.0 + KP, -KP * 0.3]) if abs(root.imag) < 1e-9)
    seen = move("stiffening_elasticity", values, ELASTIC, command=0.3, held=1.0)
    yield seen[MOTOR_POSITION][100:], deflection, 1e-9
    yield seen[TORQUE][100:], KP * (0.3 - deflection), 1e-9


@closed_form
def backlash() -> Pairs:
    slope = KP / (1.0 + KP / STIFFNESS)
    for command in (0.004, -0.009, 0.03, -0.05):  # a held joint feels only what goes beyond the gap
        seen, lead = move("backlash", {"gap": 0.02}, ELASTIC, command, held=1.0), np.clip(command, -0.01, 0.01)
        yield seen[TORQUE], slope * (command - lead), 1e-12
        yield seen[MOTOR_POSITION], lead + slope * (command - lead) / STIFFNESS, 1e-12
    seen = move("backlash", {"gap": 0.02, "crossing": 0.05}, ELASTIC, command=0.008, held=1.0)
    lead = 0.008 * (1.0 - np.exp(-(T + DT) / 0.05))
    yield seen[TORQUE], slope * (0.008 - lead), 1e-12
    yield seen[MOTOR_POSITION], lead + seen[TORQUE] / STIFFNESS, 1e-12
    for command in (0.05, -0.03):  # the torque feels at once what the torque deflects
        seen = move("backlash", {"smooth": 0.02, "softness": 0.002}, ELASTIC, command, held=1.0)
        lead = np.copysign(0.01, command) + KP * (command - seen[MOTOR_POSITION]) / STIFFNESS
        yield seen[MOTOR_POSITION][50:], lead[50:], 1e-6
    for speed in (0.1, -0.1):
        seen = move("backlash", {"play": 0.02}, v=speed)
        yield seen[MOTOR_POSITION], np.sign(speed) * np.maximum(0.1 * T - 0.01, 0.0), 1e-9


@closed_form
def transmission_error() -> Pairs:
    seen = move("transmission_error", {"sine": 0.003, "cosine": -0.002, "harmonic": 30.0}, v=2.0)
    yield seen[MOTOR_POSITION] - 2.0 * T, 0.003 * np.sin(60.0 * T) - 0.002 * np.cos(60.0 * T), 1e-9


@closed_form
def position_offset() -> Pairs:
    yield move("position_offset", {"offset": 0.03}, SERVO, command=0.2, q=0.17)[POSITION], 0.17, 1e-12


# --- joint and mechanism ---------------------------------------------------------------------------------------------


@closed_form
def joint_coupling() -> Pairs:
    """Its neighbours roll freely at 3 and -2 rad/s from 0.5 and 0.7 rad."""
    kinds = ("damping_previous", "damping_next", "friction_previous", "friction_next")
    values = dict(zip(kinds, (0.01, 0.02, 0.03, 0.05), strict=True)) | {"rounding": 2.0}
    values |= {"stiffness_previous": 0.06, "stiffness_next": -0.07}
    steady = 0.01 * 3.0 - 0.02 * 2.0 + 0.03 * np.tanh(1.5) - 0.05 * np.tanh(1.0)
    rolling = 0.06 * (0.5 * T + 1.5 * T**2) - 0.07 * (0.7 * T - T**2)
    seen = move("joint_coupling", values, q=np.array([0.5, 0.0, 0.7]), v=np.array([3.0, 0.0, -2.0]))
    yield seen[VELOCITY], (steady * T + rolling) / INERTIA, 1e-3


@closed_form
def joint_stop() -> Pairs:
    """Half a period of an oscillator, as long as it pushes."""
    for damping in (0.0, 0.05):
        seen = move("joint_stop", {"upper": 0.02, "stiffness": 5.0, "damping": damping}, v=1.0)
        depth = linear([[0.0, 1.0], [-5.0 / INERTIA, -damping / INERTIA]], [0.0, 1.0])
        speed = np.gradient(depth, DT)
        ends = int(np.argmax(5.0 * depth + damping * speed < 0.0))
        met = 200
        yield seen[POSITION][met : met + ends], 0.02 + depth[:ends], 2e-4
        yield seen[VELOCITY][met + ends + 10 :], speed[ends], 5e-3
    # of rubber, and below: the push gives back what it took
    seen = move("joint_stop", {"lower": -0.02, "stiffness": 5.0, "depth": 0.01, "exponent": 2.0}, v=-1.0)
    depth = np.maximum(-0.02 - seen[POSITION], 0.0)
    yield 0.5 * INERTIA * seen[VELOCITY] ** 2, 0.5 * INERTIA - 500.0 * depth**3 / 3.0, 2e-5


@closed_form
def coupling_error() -> Pairs:
    """The leader rests where its controller carries its own weight and that of its follower."""
    weight = 0.2 * 9.81 * 0.1
    carried = weight * (np.sin(0.3) + 1.4 * np.sin(1.4 * 0.3 + 0.05))
    values, command = {"ratio": 0.4, "offset": 0.05}, 0.3 + carried / KP
    seen = move("coupling_error", values, SERVO, command, q=np.array([0, 0, 0.3]), gravity=9.81, joint="c")
    yield seen[POSITION], 0.3, 1e-9


# --- the same law in MuJoCo ------------------------------------------------------------------------------------------

POSITION_SERVO = '<general joint="b" biastype="affine" gainprm="{kp}" biasprm="{bias} -{kp} -{kd}" {more}/>'
MOTOR = '<dcmotor joint="b" motorconst="1" resistance="1e9" {more}/>'
SOLID = 'solreffriction="1e-4 1" solimpfriction="0.9999 0.9999 1 0.5 2"'


def servo(kp: float = KP, kd: float = KD, bias: float = 0.0, more: str = "") -> str:
    return POSITION_SERVO.format(kp=kp, kd=kd, bias=bias, more=more)


MUJOCO: dict[str, tuple[dict[str, float], dict[str, str]]] = {
    "viscous_friction": ({"damping": 0.1}, {"joint": 'damping="0.1"'}),
    "nonlinear_drag": ({"coefficient": 0.02}, {"joint": 'damping="0 0.02"'}),
    "coulomb_friction": ({"friction": 0.1}, {"joint": f'frictionloss="0.1" {SOLID}'}),
    "presliding_friction": (
        {"breakaway": 0.05, "excess": 0.2, "micro_damping": 0.1},
        {"actuator": servo() + MOTOR.format(more='lugre="4 0.1 0.2 0.2 1"')},
    ),
    "command_delay": ({"delay": 0.02}, {"actuator": servo(more='delay="0.02" nsample="300"')}),
    "torque_gain": ({"error": 0.3}, {"actuator": servo(kp=1.3 * KP, kd=1.3 * KD)}),
    "torque_bias": ({"bias": 0.1}, {"actuator": servo(bias=0.1)}),
    "torque_saturation": ({"limit": 0.3}, {"actuator": servo(more='forcerange="-0.3 0.3"')}),
    "cogging": ({"joint_sine": 0.1, "harmonic": 9.0}, {"actuator": servo() + MOTOR.format(more='cogging="0.1 9 0"')}),
    "position_torque": ({"stiffness": 0.8, "bias": 0.2}, {"joint": 'stiffness="0.8" springref="0.25"'}),
    "reflected_inertia": ({"excess": 0.004}, {"joint": 'armature="0.005"'}),
    "payload": (
        {"mass": 0.1, "distance": 0.15},
        {"body": '<body pos="0 0 -0.15"><inertial pos="0 0 0" mass="0.1" diaginertia="1e-9 1e-9 1e-9"/></body>'},
    ),
}
"""Effect -> its values, and what of MuJoCo's model they stand for."""


def mujoco_positions(command: np.ndarray, joint: str = "", actuator: str = servo(), body: str = ""):
    """Positions (STEPS,) of MuJoCo's pendulum under a servo."""
    armature = "" if "armature" in joint else 'armature="0.001"'
    model = mujoco.MjModel.from_xml_string(
        f'''<mujoco><compiler angle="radian"/><option timestep="{DT}" integrator="implicitfast"/><worldbody><body>
        <inertial pos="0 0 -0.1" mass="0.2" diaginertia="2e-3 2e-3 2e-3"/>
        <joint name="b" axis="0 1 0" {armature} {joint}/>{body}</body></worldbody>
        <actuator>{actuator}</actuator></mujoco>'''
    )
    data, seen = mujoco.MjData(model), np.zeros(STEPS)
    for k in range(STEPS):
        seen[k] = data.qpos[0]
        data.ctrl[0] = command[k]
        mujoco.mj_step(model, data)
    return seen


@pytest.mark.parametrize("name", list(MUJOCO))
def test_a_joint_moves_as_mujocos_with_the_same_law(name: str) -> None:
    (values, theirs), command = MUJOCO[name], 0.4 * np.sin(15.0 * T) + 0.2 * np.sin(47.0 * T)
    ours, expected = move(name, values, SERVO, command, gravity=9.81)[POSITION], mujoco_positions(command, **theirs)
    acts = np.max(np.abs(expected - mujoco_positions(command)))
    assert acts > 0.01
    assert np.max(np.abs(ours - expected)) < 0.02 * acts


# --- all of them -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", list(CLOSED_FORMS))
def test_a_joint_moves_as_the_closed_form_of_its_effect(name: str) -> None:
    for seen, expected, apart in CLOSED_FORMS[name]():
        assert np.max(np.abs(seen - expected)) <= apart


def test_every_effect_has_a_motion_that_is_known_from_elsewhere() -> None:
    assert CLOSED_FORMS.keys() | MUJOCO.keys() == catalogue().keys(), "add a row of MuJoCo's, or a closed form"


def test_neutral_effects_leave_every_joint_as_it_is_bit_for_bit() -> None:
    constants = DrivetrainConstants(**ELASTIC | {"static_friction": 0.02, "torque_limit": 0.8})
    plain = plant().memory(constants, gravity=(1.0, 0.0, -9.81))
    neutral = plain.copy()
    for effect in catalogue().values():
        for joint in plant().joint_names:
            plant().set_effect(neutral, effect, joint, {one.name: one.neutral for one in effect.parameters})
    command, rows = np.sin(np.outer(T, [15.0, 22.0, 31.0])), np.array(SEEN)
    seen = np.zeros((2, STEPS, len(SEEN), 3))
    for memory, out in zip((plain, neutral), seen, strict=True):
        plant().kernel.rollout(command, 0, 1, memory, rows, out)
    assert np.array_equal(seen[0], seen[1])
