"""How a joint moves under each effect: as in MuJoCo where it has the law, else by a closed form of the motion."""

from functools import cache
from math import tanh

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


def linear(matrix: list[list[float]], *start: float) -> np.ndarray:
    """First state (STEPS,) of x' = A x."""
    roots, vectors = np.linalg.eig(np.array(matrix))
    return np.real((vectors * np.linalg.solve(vectors, np.array(start, dtype=complex)))[0] @ np.exp(np.outer(roots, T)))


def bounce(damping: float) -> np.ndarray:
    """Positions of a joint that meets a stop of 5 N m/rad at 0.02 rad with 1 rad/s, until the stop pushes no more."""
    depth = linear([[0.0, 1.0], [-5.0 / INERTIA, -damping / INERTIA]], 0.0, 1.0)
    speed = np.gradient(depth, DT)
    left = int(np.argmax(5.0 * depth + damping * speed < 0.0))
    there = np.where(np.arange(STEPS) < left, depth, depth[left] + speed[left] * (T - T[left]))
    return np.where(T < 0.02, T, 0.02 + np.roll(there, 200))


def led(width: float, softness: float, command: np.ndarray, fine: int = 10) -> np.ndarray:
    """Reading (STEPS,) that leads a joint by half a width with the torque, which is found by bisection."""
    q, v, seen = 0.0, 0.0, np.zeros(STEPS)
    for k, wanted in enumerate(command.tolist()):
        for i in range(fine):
            low, high = -5.0, 5.0
            while high - low > 1e-9:
                torque = 0.5 * (low + high)
                lead = 0.5 * width * tanh(torque / softness)
                low, high = (torque, high) if KP * (wanted - q - lead) - KD * v > torque else (low, torque)
            if i == fine // 2:
                seen[k] = q + lead
            v += DT / fine * torque / INERTIA
            q += DT / fine * v
    return seen


def settled(value: float) -> np.ndarray:
    """A value from the hundredth step on."""
    return np.where(T < 100 * DT, np.nan, value)


# --- closed forms of motion ------------------------------------------------------------------------------------------

DRY = FREE | {"static_friction": 0.02}
PER_INERTIA, RAMP, STEP = T / INERTIA, 0.5 * T, np.where(T > 0.0, -0.3, 0.0)
HELD = 50.5 * DT * (np.arange(STEPS) // 101)
SLOPE = KP / (1.0 + KP / STIFFNESS)
CLAMPED = {"drive": ELASTIC, "held": 1.0}
# with an exponent of 1, u = exp(v / vs) decays linearly: u' = -(F u + E) / (J vs)
STICK = {"excess": 0.05, "velocity": 0.3, "exponent": 1.0}
LOG_SPEED = np.log(np.maximum((np.exp(1.0 / 0.3) + 2.5) * np.exp(-0.02 * PER_INERTIA / 0.3) - 2.5, 1.0))
ONE_SIDED = {"difference": 0.02, "ratio": 0.3, "friction": 0.01}
WARMING = {"change": -0.02, "time_constant": 0.1, "friction": 0.01}
IMPULSE = (0.03 - 0.02) * T + 0.02 * 0.1 * (1.0 - np.exp(-T / 0.1))
START = {"drive": SERVO, "q": 0.2}
CASCADE = {"ki": 20.0, "lag": 0.06}
LAGS = {"time_constant": 0.004, "second": 0.006}
AS_FILTERED = [[0, 1, 0, 0], [-KP / INERTIA, 0, 0, -KD / INERTIA], [0, 250.0, -250.0, 0], [0, 0, 1 / 0.006, -1 / 0.006]]
AS_LAGGED = [[0, 1, 0], [0, 0, 1 / INERTIA], [-KP / 0.01, -KD / 0.01, -1 / 0.01]]
AS_INTEGRATED = [[0, 1, 0], [-KP / INERTIA, -KD / INERTIA, 1 / INERTIA], [-20.0, 0, 0]]
AS_CASCADED = [[0, 1, 0], [-KP / INERTIA, -KD / INERTIA, 1 / INERTIA], [-20.0, -20.0 * 0.06, 0]]
AS_FED = [[0, 1, 0], [-KP / INERTIA, -KD / INERTIA, -KD / 0.005 / INERTIA], [0, 0, -1 / 0.005]]
FED = RAMP + linear(AS_FED, 0.0, -0.5, 0.5 * 0.005)  # error, its speed, and what the smoothed speed lacks
FALLING = 9.0 * (1.0 - np.exp(-0.4 * PER_INERTIA / 9.0))
# neighbours that are held and driven with 0.3 and -0.6 N m
SHUNT = {"from_previous": 0.5, "from_next": -0.25}
GIVEN = (0.5 * 0.3 - 0.25 * -0.6) / KP
SIDES = {"command": np.outer([0.1, 0.0, -0.2], np.ones(STEPS)), "held": np.array([1.0, 0.0, 1.0])}
# 20 N m/rad and 0.05 rad/(N m) in series are 10 N m/rad
# a spring of 20 N m/rad between a rotor of 1e-3 and a link of 4e-3 kg m^2: q, q', th, th'
TWO_MASSES = {"compliance": 0.05, "rotor": 1e-3, "damping": 0.01}
LINK, ROTOR = [-5e3, -2.5, 5e3, 2.5], [2e4, 10.0, -2e4 - KP / 1e-3, -10.0 - KD / 1e-3]
AS_LINK, AS_ROTOR = [[0, 1, 0, 0], LINK, [0, 0, 0, 1], ROTOR], [[0, 1, 0, 0], ROTOR[2:] + ROTOR[:2], [0, 0, 0, 1]]
AS_ROTOR += [LINK[2:] + LINK[:2]]
RIGID, ALONE = ([[0.0, 1.0], [-KP / inertia, -KD / inertia]] for inertia in (INERTIA, 1e-3))
STANDS = {"drive": SERVO, "held": 1.0, "command": 0.05}
AT_REST = np.where(T < 0.2, np.nan, 0.05 * 0.15 / 1.15)
CUBIC = {"compliance": 0.05, "cubic": 2e3}
(BENT,) = (root.real for root in np.roots([2e3, 0.0, 10.0 + KP, -KP * 0.3]) if abs(root.imag) < 1e-9)
WIDE = {"smooth": 0.03, "softness": 0.005}
PLAY = {"smooth": 0.02, "softness": 0.001}
MOVED = 0.4 * np.sin(15.0 * T) + 0.2 * np.sin(47.0 * T)
CROSSED = 0.008 * (1.0 - np.exp(-(T + DT) / 0.05))
WAVES = 0.003 * np.sin(60.0 * T) - 0.002 * np.cos(60.0 * T)
WAVE = {"sine": 0.003, "cosine": -0.002, "harmonic": 30.0}
# neighbours that roll freely at 3 and -2 rad/s from 0.5 and 0.7 rad
PULLED = {"damping_previous": 0.01, "damping_next": 0.02, "friction_previous": 0.03, "friction_next": 0.05}
PULLED |= {"rounding": 2.0, "stiffness_previous": 0.06, "stiffness_next": -0.07}
STEADY = 0.01 * 3.0 - 0.02 * 2.0 + 0.03 * np.tanh(1.5) - 0.05 * np.tanh(1.0)
ROLLING = {"q": np.array([0.5, 0.0, 0.7]), "v": np.array([3.0, 0.0, -2.0])}
SPRUNG = 0.06 * (0.5 * T + 1.5 * T**2) - 0.07 * (0.7 * T - T**2)
# a leader that carries its own weight and its follower's
CARRIED = 0.2 * 9.81 * 0.1 * (np.sin(0.3) + 1.4 * np.sin(1.4 * 0.3 + 0.05))
LEADER = {"q": np.array([0.0, 0.0, 0.3]), "command": 0.3 + CARRIED / KP, "gravity": 9.81, "joint": "c"}


def zone(form: str, rest: float) -> tuple:
    """Where a joint rests that is commanded to 0.2 rad and loaded with -0.1 K_P."""
    where = {"drive": SERVO, "command": 0.2, "q": rest, "load": -0.1 * KP}
    return "command_dead_zone", {form: 0.02}, where, POSITION, rest, 1e-9


def hanging(rest: float, weight: float) -> dict:
    """A pendulum that its controller holds at `rest` against a part of its largest weight."""
    return {"drive": SERVO, "command": rest + 0.2 * 9.81 * 0.1 * weight / KP, "q": rest, "gravity": 9.81}


BOUND = {"torque_limit": 0.4}
PRESSING = {"drive": SERVO | BOUND, "held": 1.0}
PRESSED = np.minimum(KP * RAMP + 0.5 * KD * (1.0 - np.exp(-T / 0.005)), 0.4)
WOUND = np.minimum(20.0 * 0.1 * T, 0.4)


def limited(torque: float, drive: dict[str, float] = ELASTIC) -> tuple:
    """A held pendulum whose controller asks for a torque in sum, of which it carries most of the weight by itself."""
    carried, gain = -0.8 * 0.2 * 9.81 * 0.1 * np.sin(0.3), 1.0 + KP / drive["stiffness"]
    command = -0.3 + (gain * torque - carried) / KP
    how = {"drive": drive | BOUND, "q": -0.3, "held": 1.0, "gravity": 9.81, "command": command}
    return "gravity_compensation", {"share": 0.8}, how, TORQUE, settled(np.clip(torque, -0.4, 0.4)), 1e-9


def asked(torque: float) -> dict:
    """A free joint whose controller asks for a constant torque."""
    return {"drive": FREE | {"kp": 1.0, "torque_limit": abs(torque)}, "command": 1e6 * np.sign(torque)}


def clamped(effect: str, values: dict[str, float], command: float, lead: np.ndarray | float) -> list[tuple]:
    """Torque and reading of a held joint whose motor leads it by more than its torque bends."""
    how, torque = CLAMPED | {"command": command}, SLOPE * (command - lead)
    return [
        (effect, values, how, TORQUE, torque, 1e-9),
        (effect, values, how, MOTOR_POSITION, lead + torque / STIFFNESS, 1e-9),
    ]


# fmt: off
CLOSED_FORMS = (
    # effect, values, how it is moved, signal, what it is, how far from it it may be
    ("stribeck_friction", STICK, {"drive": DRY, "v": -1.0}, VELOCITY, -0.3 * LOG_SPEED, 1e-3),
    ("stribeck_friction", STICK | {"exponent": 2.0}, {"drive": DRY, "load": -0.0699}, POSITION, 0.0, 0.0),
    ("load_dependent_friction", {"coefficient": 0.2}, asked(0.4), VELOCITY, 0.32 * PER_INERTIA, 1e-9),
    ("load_dependent_friction", {"coefficient": 0.2}, asked(-0.4), VELOCITY, -0.32 * PER_INERTIA, 1e-9),
    ("asymmetric_friction", ONE_SIDED, {"drive": DRY, "v": 4.0}, VELOCITY, 4.0 - 0.04 * 1.3 * PER_INERTIA, 1e-9),
    ("asymmetric_friction", ONE_SIDED, {"drive": DRY, "v": -3.0}, VELOCITY, -3.0 + 0.02 * 0.7 * PER_INERTIA, 1e-9),
    ("friction_drift", WARMING, {"drive": DRY, "v": 3.0}, VELOCITY, 3.0 - IMPULSE / INERTIA, 3e-4),
    ("rate_limit", {"speed": 2.0}, {"command": STEP}, COMMAND, np.clip(-2.0 * (T - 0.5 * DT), -0.3, 0.0), 1e-9),
    zone("error", 0.2 - 0.02 - 0.1),
    ("command_dead_zone", {"gate": 0.5}, {"drive": SERVO | {"kd": 0.0}, "command": 0.2, "v": 0.1}, VELOCITY, 0.1, 1e-3),
    zone("torque", 0.2 - 0.02 / KP - 0.1),
    ("command_dead_zone", {"play": 0.02}, {"command": RAMP}, COMMAND, np.maximum(RAMP - 0.02, 0.0), 1e-9),
    ("command_dead_zone", {"hold": 50.25 * DT}, {"command": RAMP}, COMMAND, HELD, 1e-9),
    ("velocity_filter_lag", LAGS, START, POSITION, linear(AS_FILTERED, 0.2, 0.0, 0.0, 0.0), 2e-4),
    ("actuator_lag", {"time_constant": 0.01}, START, POSITION, linear(AS_LAGGED, 0.2, 0.0, -0.2 * KP), 2e-4),
    ("integral_action", {"ki": 20.0}, START, POSITION, linear(AS_INTEGRATED, 0.2, 0.0, 0.2 * KP), 2e-4),
    ("integral_action", CASCADE, START, POSITION, linear(AS_CASCADED, 0.2, 0.0, 0.2 * KP), 2e-4),
    ("gravity_compensation", {"share": 0.8}, hanging(0.3, 0.2 * np.sin(0.3)), POSITION, 0.3, 1e-9),
    limited(0.38), limited(0.42), limited(0.38, SERVO), limited(0.42, SERVO), limited(-0.42),
    ("velocity_feedforward", {"gain": KD}, {"drive": SERVO, "command": RAMP}, POSITION, FED, 1e-4),
    ("velocity_feedforward", {"gain": KD}, PRESSING | {"command": RAMP}, TORQUE, PRESSED, 1e-9),
    ("integral_action", {"ki": 20.0}, PRESSING | {"command": 0.1}, TORQUE, WOUND, 1e-9),
    ("back_emf", {"stall": 0.4, "no_load": 9.0}, asked(1.0), VELOCITY, FALLING, 1e-4),
    ("back_emf", {"stall": 0.4, "no_load": 9.0}, asked(-1.0), VELOCITY, -FALLING, 1e-4),
    ("mount_tilt", {"second": 0.3}, hanging(0.1, np.sin(0.1 - 0.3)), POSITION, 0.1, 1e-9),
    ("torque_curve", {"bend": -0.5, "gain": 0.2, "reference": 0.1}, asked(-0.4), VELOCITY, -0.24 * PER_INERTIA, 1e-9),
    ("torque_crosstalk", SHUNT, SIDES | {"drive": SERVO, "q": np.array([0.0, GIVEN, 0.0])}, POSITION, GIVEN, 1e-9),
    ("elasticity", {"compliance": 0.05}, CLAMPED | {"command": 1.0}, TORQUE, 3.0 / 1.3, 1e-12),
    ("elasticity", {"compliance": 0.05}, CLAMPED | {"command": 1.0}, MOTOR_POSITION, 0.3 / 1.3, 1e-12),
    ("elastic_joint", TWO_MASSES, START, POSITION, linear(AS_LINK, 0.2, 0.0, 0.2, 0.0), 3e-4),
    ("elastic_joint", TWO_MASSES, START, MOTOR_POSITION, linear(AS_ROTOR, 0.2, 0.0, 0.2, 0.0), 3e-4),
    ("elastic_joint", TWO_MASSES | {"compliance": 1e-7}, START, POSITION, linear(RIGID, 0.2, 0.0), 3e-4),
    ("elastic_joint", TWO_MASSES, STANDS, MOTOR_POSITION, AT_REST, 1e-9),
    ("elastic_joint", TWO_MASSES | {"gap": 0.2}, STANDS, MOTOR_POSITION, 0.05 + linear(ALONE, -0.05, 0.0), 2e-4),
    ("stiffening_elasticity", CUBIC, CLAMPED | {"command": 0.3}, MOTOR_POSITION, settled(BENT), 1e-9),
    ("stiffening_elasticity", CUBIC, CLAMPED | {"command": 0.3}, TORQUE, settled(KP * (0.3 - BENT)), 1e-9),
    *clamped("backlash", {"gap": 0.02}, 0.004, 0.004),
    *clamped("backlash", {"gap": 0.02}, -0.009, -0.009),
    *clamped("backlash", {"gap": 0.02}, 0.03, 0.01),
    *clamped("backlash", {"gap": 0.02}, -0.05, -0.01),
    *clamped("backlash", {"gap": 0.02, "crossing": 0.05}, 0.008, CROSSED),
    *clamped("backlash", PLAY, 0.05, 0.01),
    *clamped("backlash", PLAY, 0.0005 / SLOPE + 0.01 * np.tanh(0.5), 0.01 * np.tanh(0.5)),
    *clamped("backlash", PLAY, -0.05, -0.01),
    ("backlash", WIDE, {"drive": SERVO, "command": MOVED}, MOTOR_POSITION, led(0.03, 0.005, MOVED), 1e-4),
    ("backlash", {"play": 0.02}, {"v": 0.1}, MOTOR_POSITION, np.maximum(0.1 * T - 0.01, 0.0), 1e-9),
    ("backlash", {"play": 0.02}, {"v": -0.1}, MOTOR_POSITION, -np.maximum(0.1 * T - 0.01, 0.0), 1e-9),
    ("transmission_error", WAVE, {"v": 2.0}, MOTOR_POSITION, 2.0 * T + WAVES, 1e-9),
    ("position_offset", {"offset": 0.03}, {"drive": SERVO, "command": 0.2, "q": 0.17}, POSITION, 0.17, 1e-12),
    ("joint_coupling", PULLED, ROLLING, VELOCITY, (STEADY * T + SPRUNG) / INERTIA, 1e-3),
    ("joint_stop", {"upper": 0.02, "stiffness": 5.0}, {"v": 1.0}, POSITION, bounce(0.0), 1e-3),
    ("joint_stop", {"upper": 0.02, "stiffness": 5.0, "damping": 0.05}, {"v": 1.0}, POSITION, bounce(0.05), 1e-3),
    ("joint_stop", {"lower": -0.02, "stiffness": 5.0, "damping": 0.05}, {"v": -1.0}, POSITION, -bounce(0.05), 1e-3),
    ("coupling_error", {"ratio": 0.4, "offset": 0.05}, LEADER | {"drive": SERVO}, POSITION, 0.3, 1e-9),
)
# fmt: on


@pytest.mark.parametrize("row", CLOSED_FORMS, ids=lambda row: row[0])
def test_a_joint_moves_as_the_closed_form_of_its_effect(row: tuple) -> None:
    name, values, how, signal, expected, apart = row
    seen = move(name, values, **how)[signal]
    looked_at = ~np.isnan(np.broadcast_to(expected, STEPS))
    assert np.max(np.abs(seen - expected)[looked_at]) <= apart


# --- the same law in MuJoCo ------------------------------------------------------------------------------------------

POSITION_SERVO = '<general {of} biastype="affine" gainprm="{kp}" biasprm="{bias} -{kp} -{kd}" {more}/>'
MOTOR = '<dcmotor joint="b" motorconst="1" resistance="1e9" {more}/>'
SOLID = 'solreffriction="1e-4 1" solimpfriction="0.9999 0.9999 1 0.5 2"'


MUJOCO_ROTOR = """<body><inertial pos="0 0 0" mass="1e-6" diaginertia="1e-3 1e-3 1e-3"/>
<joint name="r" axis="0 1 0" stiffness="20" damping="0.01"/></body>"""
SUM = """</actuator><tendon><fixed name="rotor"><joint joint="b" coef="1"/><joint joint="r" coef="1"/></fixed></tendon>
<actuator>"""


def servo(kp: float = KP, kd: float = KD, bias: float = 0.0, more: str = "", of: str = 'joint="b"') -> str:
    return POSITION_SERVO.format(kp=kp, kd=kd, bias=bias, more=more, of=of)


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
    "elastic_joint": (
        TWO_MASSES,
        {"joint": 'armature="0"', "body": MUJOCO_ROTOR, "actuator": servo(of='tendon="rotor"') + SUM},
    ),
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


def test_every_effect_has_a_motion_that_is_known_from_elsewhere() -> None:
    assert {row[0] for row in CLOSED_FORMS} | MUJOCO.keys() == catalogue().keys(), (
        "add a row of MuJoCo's, or a closed form"
    )


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
