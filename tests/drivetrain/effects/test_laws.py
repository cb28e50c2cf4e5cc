"""The law of every effect by its value: what the formula gives for plain numbers. An effect without a row fails."""

from dataclasses import dataclass, field, replace
from math import cos, cosh, exp, nan, sin, tanh

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import (
    ACCELERATION,
    ANGLE,
    COMMAND,
    COMMAND_AFTER,
    CONTROLLER_TORQUE,
    DEFLECTION,
    DIRECTION,
    FRICTION,
    JOINT_TORQUE,
    LEAD,
    LOAD,
    MEASURED_VELOCITY,
    MOTOR_POSITION,
    POSITION,
    TIME,
    TORQUE,
    VELOCITY,
    WEIGHT,
    Place,
    catalogue,
)
from tactile_cube.drivetrain.effects.command import RateLimit
from tactile_cube.drivetrain.effects.effect import FINGER, Scales, unit_at
from tactile_cube.drivetrain.effects.joint_torque import JointStop
from tactile_cube.drivetrain.effects.mechanism import Payload
from tactile_cube.drivetrain.effects.transmission import Elasticity, StiffeningElasticity
from tactile_cube.drivetrain.signals import DAMPING, GAP, INERTIA, LOOP_GAIN, LOOSE_TORQUE, ROWS, SENSOR_VELOCITY

DT = 0.002
Signal = float | tuple[float, ...] | list[float]


@dataclass(frozen=True)
class Row:
    """What a law gives.

    Attributes:
        effect: name.
        values: parameter -> value; the others are neutral.
        x: signal -> value, a list one a step, a tuple one a joint. A law that reads another one gets NaN.
        gives: what it returns; a list: at each step, NaN where that is not looked at.
        after: further signals that it changes, after the last step.
        law: which one.
        joint: of three.
    """

    effect: str
    values: dict[str, float]
    x: dict[int, Signal]
    gives: Signal
    after: dict[int, float] = field(default_factory=dict)
    law: str = "law"
    joint: int = 1

    @property
    def row(self) -> int:
        """The signal that the law gives anew."""
        others = {"torque_law": TORQUE, "ahead_law": MOTOR_POSITION}
        return int(others.get(self.law, catalogue()[self.effect].stage.value))

    def steps(self) -> list[np.ndarray]:
        """The signals (ROWS, 3) of each step."""
        lists = [len(value) for value in self.x.values() if isinstance(value, list)]
        steps = []
        for k in range(max(lists, default=1)):
            x = np.full((ROWS, 3), nan)
            x[DAMPING] = 1.0
            for signal, value in self.x.items():
                now = value[k] if isinstance(value, list) else value
                x[signal] = now if isinstance(now, tuple) else [now if j == self.joint else nan for j in range(3)]
            steps.append(x)
        return steps

    def run(self, values: dict[str, float], steps: list[np.ndarray]) -> list[float]:
        """What the law returns at each step; the signals are changed in place."""
        effect = catalogue()[self.effect]
        p = np.array([values.get(one.name, one.neutral) for one in effect.parameters])
        state = np.zeros(effect.kept(DT))
        return [float(getattr(effect, self.law)(x, self.joint, p, state, DT)) for x in steps]


def rows(effect: str, *cases: tuple, law: str = "law", joint: int = 1) -> list[Row]:
    return [Row(effect, *case, law=law, joint=joint) for case in cases]


def waves(*numbers: float) -> float:
    """Sum of sines and cosines of 7, 14 and 21 rad."""
    values = (0.6569866, 0.7539023, 0.9906074, 0.1367372, 0.8366556, -0.5477293)
    return sum(number * value for number, value in zip(numbers, values, strict=False))


# an input that goes from 3 to 4 on a straight line in one step of 2 ms, through a lag of 4 ms
RISE, TWICE = {"time_constant": 0.004}, {"time_constant": 0.004, "second": 0.004}
RISING = [3.0, 4.0, 4.0, 4.0]
SHARE = 1.0 - 2.0 * (1.0 - exp(-0.5))
RISES = [3.0, *(4.0 + (SHARE - 1.0) * exp(-0.5 * k) for k in range(3))]
MIDDLES = [k - 0.5 for k in range(100)]
BEND = {"bend": -0.5, "reference": 0.1}
SHUNT = {"from_previous": 0.5, "from_next": -0.25}, {TORQUE: (0.1, 0.2, 0.4)}
AT_7 = {ANGLE: 0.7, TORQUE: 0.5, JOINT_TORQUE: 0.5, MOTOR_POSITION: 0.5}
SOFT = {"smooth": 0.02, "softness": 0.01}
PLAY = {POSITION: 0.4, LOOP_GAIN: 3.0, LEAD: nan, GAP: 0.0}
ROTOR = {"compliance": 0.05, "rotor": 0.002, "damping": 0.01}
ROLLS = {VELOCITY: 2.0, TORQUE: 0.5, DAMPING: 1.0}
RUBS = {FRICTION: 0.2, INERTIA: 0.006, LOAD: 0.0, JOINT_TORQUE: 0.0}
HARDENING = {"compliance": 0.06, "cubic": 2e3}
ONE_WAY = {"damping": 0.05, "difference": 0.04}
LINE = {"first": -0.8, "last": 0.8} | {f"torque_{k}": 0.1 * k - 0.3 for k in range(17)}
BUMPS = {"first": -0.8, "last": 0.8, "torque_10": 0.06, "torque_0": 0.12, "torque_16": -0.12}
SIDES = {VELOCITY: (3.0, nan, -2.0), POSITION: (0.5, nan, 0.7), JOINT_TORQUE: 0.1}
RING = {VELOCITY: (8.0, 2.0, nan), POSITION: (0.5, 0.7, nan), JOINT_TORQUE: (nan, nan, 0.1)}
UPPER, LOWER = {"upper": 0.5, "stiffness": 10.0, "depth": 0.1}, {"lower": -0.5, "stiffness": 10.0, "depth": 0.1}
STICK = {"excess": 0.08, "velocity": 0.3}
BRISTLES, DAMPED = {"breakaway": 1e-3}, {"breakaway": 1e-3, "micro_damping": 0.5}
GONE = 0.05 * 0.04 / DT * (1.0 - exp(-1.0))
SUPPLY = {"stall": 0.4, "no_load": 10.0}
AT_REST = {CONTROLLER_TORQUE: [0.25] * 3, LOAD: 0.3, COMMAND: 0.5, MOTOR_POSITION: 0.38, DEFLECTION: 0.02}
AT_REST |= {VELOCITY: 0.0, FRICTION: 0.0, TORQUE: 0.25}
MOVED = {COMMAND: [0.5, 9.0, 9.0], MOTOR_POSITION: [0.1, 0.3, 0.3]}
LIMITED = [0.3, 0.4, 0.4, 0.35, -0.35]  # a rate limit follows by the end of a step, its mean is what acts in it
MEANS = [0.3, 0.35, 0.4, 0.375, 0.0]
JUMP = {CONTROLLER_TORQUE: 0.1, COMMAND: [0.3, 0.34, 0.34]}
SLIDE = {FRICTION: 0.1, JOINT_TORQUE: 0.5}
KEPT = exp(-0.2)  # of a bristle's bend, when 0.1 rad/s move it for 2 ms
# fmt: off
ROWS_OF_LAWS = (
    *rows(
        "command_dead_zone",
        ({"error": 0.02}, {COMMAND: 0.5, MOTOR_POSITION: 0.4, VELOCITY: 1.0}, 0.48),
        ({"error": 0.02}, {COMMAND: 0.5, MOTOR_POSITION: 0.6, VELOCITY: 1.0}, 0.52),
        ({"error": 0.02}, {COMMAND: 0.5, MOTOR_POSITION: 0.486, VELOCITY: 2.0}, 0.49),  # the reading a step later
        ({"gate": 0.02}, {COMMAND: 0.5, MOTOR_POSITION: 0.4, VELOCITY: 1.0}, 0.5),
        ({"gate": 0.02}, {COMMAND: 0.5, MOTOR_POSITION: 0.6, VELOCITY: 1.0}, 0.5),
        ({"gate": 0.02}, {COMMAND: 0.5, MOTOR_POSITION: 0.486, VELOCITY: 2.0}, 0.49),
        ({"gate": 0.02}, {COMMAND: 0.5, MOTOR_POSITION: 0.515, VELOCITY: -1.0}, 0.513),
        ({"hold": 0.02}, {COMMAND: [0.5, 0.51, 0.53, 0.54, 0.56, 0.545, 0.4]}, [0.5, 0.5, 0.53, 0.53, 0.56, 0.56, 0.4]),
        ({"play": 0.02}, {COMMAND: [0.5, 0.51, 0.53, 0.5, 0.45]}, [0.5, 0.5, 0.51, 0.51, 0.47]),
    ),
    *rows(
        "command_dead_zone",
        ({"torque": 0.1}, {TORQUE: 0.3}, 0.2),
        ({"torque": 0.1}, {TORQUE: -0.3}, -0.2),
        ({"torque": 0.1}, {TORQUE: 0.05}, 0.0),
        ({"torque": 0.1}, {TORQUE: -0.05}, 0.0),
        law="torque_law",
    ),
    *rows(
        "rate_limit",
        ({"speed": 10.0}, {COMMAND_AFTER: LIMITED, COMMAND: MEANS}, [0.3, 0.31, 0.33, 0.345, 0.34]),
        ({"speed": 1e9}, {COMMAND_AFTER: LIMITED, COMMAND: [0.3, 0.31, 0.4, 0.36, 0.2]}, [0.3, 0.31, 0.4, 0.36, 0.2]),
    ),
    *rows(
        "command_delay",
        ({"delay": 0.005}, {COMMAND: [1.0, 2.0, 4.0, 8.0, 16.0]}, [1.0, 1.0, 1.0, 1.5, 3.0]),
        ({"delay": 0.1}, {COMMAND: [*range(60)]}, [0.0] * 50 + [*range(10)]),
    ),
    *rows(
        "velocity_filter_lag",
        (RISE, {MEASURED_VELOCITY: RISING, ACCELERATION: 0.0}, RISES),
        # a ramp comes out late by both time constants, 10 ms or 5 steps
        (RISE | {"second": 0.006}, {MEASURED_VELOCITY: [*range(100)], ACCELERATION: 0.0}, [nan] * 99 + [94.0]),
        # also that of a speed read in the middle of each step, where its end is what is remembered
        (RISE, {MEASURED_VELOCITY: MIDDLES, ACCELERATION: 500.0}, [nan] * 99 + [97.0 - 0.5 * SHARE]),
        (TWICE, {MEASURED_VELOCITY: MIDDLES, ACCELERATION: 500.0}, [nan] * 99 + [95.0 - 0.5 * SHARE**2]),
    ),
    *rows(
        "actuator_lag",
        (RISE, {TORQUE: RISING, ACCELERATION: 0.0}, RISES),
        (RISE, {TORQUE: [-k for k in MIDDLES], DAMPING: 2.0, ACCELERATION: 250.0}, [nan] * 99 + [0.5 * SHARE - 97.0]),
    ),
    *rows(
        "integral_action",
        # begins as what the load takes beyond the controller's torque, then grows by 4 N m/(rad s) * 0.1 rad
        ({"ki": 4.0}, AT_REST, [0.3, 0.3008, 0.3016]),
        ({"ki": 4.0, "limit": 0.0512}, AT_REST | {LOAD: 0.3}, [0.3, 0.3008, 0.3012]),
        ({"ki": 4.0, "limit": 0.04}, AT_REST, [0.29, 0.29, 0.29]),
        # a joint that moves rubs, as far as its damping tells
        ({"ki": 4.0}, AT_REST | {VELOCITY: -0.5, FRICTION: 0.1, DAMPING: 0.2}, [0.25, nan, nan]),
        # the error counts as linear over the step before
        ({"ki": 1.0}, AT_REST | MOVED, [0.3, 0.3 + 4.53 * DT, nan]),
        # of a cascade's error the joint's way of 0.2 rad counts for 0.05 s
        ({"ki": 1.0, "lag": 0.05}, AT_REST | MOVED, [0.3, 0.3 + 4.53 * DT - 0.05 * 0.2, nan]),
    ),
    *rows("gravity_compensation", ({"share": 0.8}, {CONTROLLER_TORQUE: 0.1, WEIGHT: -0.5}, -0.3)),
    *rows(
        "velocity_feedforward",
        # of a jump by 40 mrad all comes in the end, as an impulse, the rest of it with a decay of exp(-1) a step
        ({"gain": 0.05, "smoothing": DT}, JUMP, [0.1, 0.1 + GONE, 0.1 + GONE * exp(-1.0)]),
    ),
    *rows("torque_gain", ({"error": 0.1}, {TORQUE: -0.3}, -0.33)),
    *rows(
        "torque_curve",
        (BEND, {TORQUE: 0.4}, 0.2),
        (BEND, {TORQUE: -0.025}, -0.05),
        (BEND, {TORQUE: 4e-4}, 4e-3),  # straight below a hundredth of the reference
        ({"bend": 1.0, "gain": 0.2, "reference": 0.1}, {TORQUE: -0.3}, -1.08),
        ({"gain": 0.2}, {TORQUE: -0.3}, -0.36),
    ),
    *rows("torque_bias", ({"bias": 0.02}, {TORQUE: -0.3}, -0.28)),
    *(Row("torque_crosstalk", *SHUNT, gives, joint=j) for j, gives in enumerate((0.25, 0.15, 0.475))),
    *rows(
        "cogging",
        ({"sine": 0.02, "cosine": 0.03}, AT_7, 0.5 + waves(0.02, 0.03)),
        ({"sine_2": 0.02, "cosine_2": 0.03}, AT_7, 0.5 + waves(0, 0, 0.02, 0.03)),
        ({"sine_3": 0.02, "cosine_3": 0.03}, AT_7, 0.5 + waves(0, 0, 0, 0, 0.02, 0.03)),
        ({"sine": 0.02, "harmonic": 20.0}, AT_7, 0.5 + waves(0, 0, 0.02)),
        ({"joint_sine": 0.02, "sine_2": 0.1}, AT_7, 0.5),
        ({"joint_cosine": 0.02, "sine_2": 0.1}, AT_7, 0.5),
        law="torque_law",
    ),
    *rows(
        "cogging",
        ({"joint_sine": 0.02, "joint_cosine": 0.03}, AT_7, 0.5 + waves(0.02, 0.03)),
        ({"joint_cosine": 0.1, "sine_2": 0.02, "cosine_2": 0.03}, AT_7, 0.5 + waves(0, 0.1, 0.02, 0.03)),
        ({"joint_sine": 0.1, "sine_3": 0.02, "cosine_3": 0.03}, AT_7, 0.5 + waves(0.1, 0, 0, 0, 0.02, 0.03)),
        ({"sine": 0.02, "cosine": 0.03, "sine_2": 0.1}, AT_7, 0.5),
    ),
    *rows(
        "torque_saturation",
        ({"limit": 0.3}, {TORQUE: 0.2}, 0.2),
        ({"limit": 0.3}, {TORQUE: 0.5}, 0.3),
        ({"limit": 0.3}, {TORQUE: -0.5}, -0.3),
        ({"limit": 0.3, "softness": 1.0}, {TORQUE: -0.6}, -0.2),
        ({"limit": 0.3, "softness": 0.5}, {TORQUE: -0.4}, -0.24),
        ({"limit": 0.3, "softness": 0.02}, {TORQUE: 0.4}, 0.3),
    ),
    *rows(
        "back_emf",
        (SUPPLY, {TORQUE: 0.2, VELOCITY: 4.0}, 0.2),
        (SUPPLY, {TORQUE: 0.5, VELOCITY: 4.0}, 0.24),
        (SUPPLY, {TORQUE: -0.5, VELOCITY: -6.0}, -0.16),
        (SUPPLY, {TORQUE: 0.5, VELOCITY: -2.0}, 0.48),  # the supply helps to brake
        (SUPPLY, {TORQUE: 0.5, VELOCITY: 12.0}, -0.08),
        ({"no_load": 5.0}, {TORQUE: 0.5, VELOCITY: 12.0}, 0.5),
    ),
    *rows(
        "stiffening_elasticity",
        ({"compliance": 0.06}, {TORQUE: 0.5, DEFLECTION: 0.02}, 0.05),
        # 25 N m/rad and 0.06 rad/(N m) in series are 10 N m/rad; 10 d + 2000 d^3 is 0.354 N m at 0.03 rad
        (HARDENING, {TORQUE: 0.354, DEFLECTION: 0.354 / 25.0}, 0.03),
        (HARDENING, {TORQUE: -0.354, DEFLECTION: -0.354 / 25.0}, -0.03),
    ),
    *rows(
        "backlash",
        ({"play": 0.02}, {MOTOR_POSITION: [0.5, 0.53, 0.52, 0.51, 0.5]}, [0.5, 0.52, 0.52, 0.52, 0.51]),
        *(
            (SOFT, {MOTOR_POSITION: 0.4, TORQUE: torque}, 0.4 + lead)
            for torque, lead in ((0.02, 0.01 * tanh(2.0)), (-0.005, -0.01 * tanh(0.5)), (1.0, 0.01), (-1.0, -0.01))
        ),
    ),
    *rows(
        "backlash",
        *(
            ({"gap": 0.02} | more, {MOTOR_POSITION: 0.402, POSITION: 0.4, LEAD: lead, GAP: 0.0}, 0.402 + gives, after)
            for lead, more, gives, after in (  # the sensor shows 2 mrad already, by another law before this one
                (0.032, {}, 0.01, {GAP: 1.0, DAMPING: 1.0, LEAD: 0.03}),
                (-0.028, {}, -0.01, {GAP: 1.0, DAMPING: 1.0}),
                (0.008, {}, 0.006, {GAP: 2.0, DAMPING: 0.0}),
                (0.008, {"crossing": 0.004}, 0.006 * (1.0 - exp(-0.5)), {GAP: 2.0, DAMPING: 1.0}),
            )
        ),
        *(  # a torque, and what it was before 3 N m/rad met its lead; another law shows 2 mrad before this one
            (SOFT, PLAY | {MOTOR_POSITION: 0.402, LOOSE_TORQUE: torque + 3.0 * (0.002 + lead)}, 0.402 + lead, after)
            for torque, lead, after in (
                (0.02, 0.01 * tanh(2.0), {GAP: 1.0, DAMPING: 1.0 / (1.0 + 3.0 / cosh(2.0) ** 2)}),
                (-0.005, -0.01 * tanh(0.5), {GAP: 2.0, LEAD: -0.005 / 3.0 - 0.01 * tanh(0.5)}),
                (0.5, 0.01, {GAP: 1.0, DAMPING: 1.0}),
                (0.0, 0.0, {GAP: 2.0, DAMPING: 0.25}),
            )
        ),
        law="ahead_law",
    ),
    *rows(  # hangs in a spring at first, then the rotor goes on at 3 rad/s while its link gets 0.4 rad/s slower
        "elastic_joint",
        (
            {"compliance": 0.05},
            {VELOCITY: 3.0, MEASURED_VELOCITY: 3.0, SENSOR_VELOCITY: 3.0, LOAD: 0.2, ACCELERATION: 0.0},
            3.0,
            {SENSOR_VELOCITY: 3.0},
        ),
    ),
    *rows(  # 2 rotor / dt + damping is 3 N m s/rad of the motor, dt / 2 / compliance + damping 0.03 of the spring
        "elastic_joint",
        (ROTOR, ROLLS, 0.03 * 0.5 / 3.03, {DAMPING: 0.09 / 3.03 - 2.0}),
        (ROTOR | {"gap": 0.02}, ROLLS, 0.0, {DAMPING: -2.0}),
        (ROTOR | {"motor_share": 0.5}, RUBS | ROLLS, 0.03 * (0.5 - 0.1) / 3.03, {DAMPING: 0.09 / 3.03 - 2.0}),
        (ROTOR | {"motor_share": 0.5}, RUBS | {VELOCITY: 0.0, TORQUE: 0.05}, 0.0, {DAMPING: 0.03 - 2.0}),
        (ROTOR | {"motor_damping": 0.5}, ROLLS, 0.03 * (0.5 - 1.0) / 3.53, {DAMPING: 0.105 / 3.53 - 2.0}),
        law="torque_law",
    ),
    *rows(
        "transmission_error",
        ({"sine": 0.002, "cosine": 0.003}, AT_7, 0.5 + waves(0.002, 0.003)),
        ({"sine": 0.002, "harmonic": 20.0}, AT_7, 0.5 + waves(0, 0, 0.002)),
    ),
    *rows("position_offset", ({"offset": 0.02}, {MOTOR_POSITION: 0.5}, 0.52)),
    *rows(
        "viscous_friction",
        (ONE_WAY, {VELOCITY: 2.0, JOINT_TORQUE: 0.5}, 0.5 - 0.07 * 2.0),
        (ONE_WAY, {VELOCITY: -2.0, JOINT_TORQUE: 0.5}, 0.5 + 0.03 * 2.0),
    ),
    *rows(
        "nonlinear_drag",
        ({"coefficient": 0.025}, {VELOCITY: 4.0, JOINT_TORQUE: 0.5}, 0.5 - 0.4),
        ({"coefficient": 0.025}, {VELOCITY: -2.0, JOINT_TORQUE: 0.5}, 0.5 + 0.1),
        ({"coefficient": 0.025, "power": 1.5}, {VELOCITY: 0.0, JOINT_TORQUE: 0.5}, 0.5),
        ({"coefficient": 0.025, "power": 3.0, "speed": 2.0}, {VELOCITY: 4.0, JOINT_TORQUE: 0.5}, 0.5 - 0.8),
        ({"coefficient": 0.025, "power": 1.5, "speed": 2.0}, {VELOCITY: -8.0, JOINT_TORQUE: 0.5}, 0.5 + 0.8),
    ),
    *rows(
        "position_torque",
        ({"stiffness": 0.3, "bias": 0.1}, {ANGLE: 0.5, JOINT_TORQUE: 0.2}, 0.15),
        # a spline whose controls lie on a line is that line
        *((LINE, {ANGLE: q, JOINT_TORQUE: 0.2}, 0.2 + q + 0.5) for q in (-0.65, 0.03, 0.37, 0.64)),
        # one control gives 2/3 at its knot, 1/6 at the next, 23/48 between; beyond the ends the torque stays
        *(
            (BUMPS, {ANGLE: q, JOINT_TORQUE: 0.2}, 0.2 + gives)
            for q, gives in ((0.2, 0.04), (0.1, 0.01), (0.25, 0.02875), (-0.8, 0.1), (-2.0, 0.1), (2.0, -0.1))
        ),
    ),
    *rows(
        "joint_coupling",
        ({"damping_previous": 0.2}, SIDES, 0.1 + 0.6),
        ({"damping_next": 0.2}, SIDES, 0.1 - 0.4),
        ({"friction_previous": 0.2, "rounding": 3.0}, SIDES, 0.1 + 0.2 * tanh(1.0)),
        ({"friction_next": 0.2, "rounding": 2.0}, SIDES, 0.1 - 0.2 * tanh(1.0)),
        ({"stiffness_previous": 0.2}, SIDES, 0.1 + 0.1),
        ({"stiffness_next": 0.2}, SIDES, 0.1 + 0.14),
    ),
    *rows("joint_coupling", ({"damping_previous": 0.2, "damping_next": 0.1}, RING, 0.1 + 1.2), joint=2),
    *(
        Row("joint_stop", values | more, {ANGLE: angle, VELOCITY: speed, JOINT_TORQUE: 0.5}, 0.5 + torque)
        for values, more, angle, speed, torque in (
            (UPPER, {}, 0.49, 9.0, 0.0),
            (UPPER, {}, 0.7, 9.0, -2.0),
            (LOWER, {}, -0.7, 9.0, 2.0),
            (UPPER, {"damping": 0.5}, 0.7, 3.0, -3.5),
            (LOWER, {"damping": 0.5}, -0.7, -3.0, 3.5),
            (UPPER, {"damping": 0.5}, 0.7, -9.0, 0.0),  # it never pulls
            (LOWER, {"damping": 0.5}, -0.7, 9.0, 0.0),
            (UPPER, {"exponent": 2.0}, 0.7, 0.0, -4.0),
            (LOWER, {"exponent": 2.0}, -0.55, 0.0, 0.25),
        )
    ),
    *rows("coulomb_friction", ({"friction": 0.03}, {FRICTION: 0.02}, 0.05)),
    *rows(
        "stribeck_friction",
        (STICK, {VELOCITY: 0.0, FRICTION: 0.02}, 0.1),
        (STICK, {VELOCITY: -0.6, FRICTION: 0.02}, 0.02 + 0.08 * exp(-4.0)),
        (STICK | {"exponent": 1.0}, {VELOCITY: -0.6, FRICTION: 0.02}, 0.02 + 0.08 * exp(-2.0)),
        (STICK | {"exponent": 0.5}, {VELOCITY: 2.7, FRICTION: 0.02}, 0.02 + 0.08 * exp(-3.0)),
        (STICK | {"exponent": 0.5}, {VELOCITY: 0.0, FRICTION: 0.02}, 0.1),
    ),
    *rows(
        "load_dependent_friction",
        ({"coefficient": 0.2}, {TORQUE: 0.4, FRICTION: 0.02}, 0.1),
        ({"coefficient": 0.2}, {TORQUE: -0.4, FRICTION: 0.02}, 0.1),
    ),
    *rows(
        "asymmetric_friction",
        ({"difference": 0.04}, {DIRECTION: 1.0, FRICTION: 0.1}, 0.12),
        ({"difference": 0.04}, {DIRECTION: -1.0, FRICTION: 0.1}, 0.08),
        ({"ratio": 0.3, "friction": 0.02}, {DIRECTION: 1.0, FRICTION: 0.1}, 0.156),
        ({"ratio": 0.3, "friction": 0.02}, {DIRECTION: -1.0, FRICTION: 0.1}, 0.084),
    ),
    *(
        Row("friction_drift", values, {TIME: (3.0, 3.0, 3.0), FRICTION: 0.1}, gives)
        for values, gives in (
            ({"change": 0.05, "time_constant": 6.0}, 0.1 + 0.05 * (1.0 - exp(-0.5))),
            ({"change": -0.05, "time_constant": 3.0, "friction": 0.02}, 0.12 - 0.05 * (1.0 - exp(-1.0))),
            ({"friction": 0.03}, 0.13),
            ({"change": -0.5, "time_constant": 3.0}, 0.0),
        )
    ),
    *rows("presliding_friction", ({"excess": 0.02}, {FRICTION: 0.1}, 0.12)),
    *(
        Row("presliding_friction", p, {VELOCITY: speed, **SLIDE}, 0.0, {JOINT_TORQUE: 0.5 + torque, DAMPING: damping})
        for speed, p, torque, damping in (
            (0.1, BRISTLES, -0.1 * (1.0 - KEPT), 1.0),
            (-0.1, BRISTLES | {"excess": 0.02}, 0.12 * (1.0 - KEPT), 1.0),
            (0.1, BRISTLES | {"excess": -0.2}, 0.0, 1.0),
            ([0.1] * 99 + [-0.1], BRISTLES, -0.1 * (2.0 * KEPT - 1.0), 1.0),
            (0.1, DAMPED, -0.1 * (1.0 - KEPT) - 0.05 * KEPT, 1.0 + 0.5 * KEPT),
            ([0.1] * 99 + [-0.1], DAMPED, -0.1 * (2.0 * KEPT - 1.0) + 0.1 * KEPT, 1.0 + KEPT),
        )
    ),
)
# fmt: on


@pytest.mark.parametrize("row", ROWS_OF_LAWS, ids=lambda row: row.effect)
def test_a_law_gives_what_its_formula_says(row: Row) -> None:
    steps = row.steps()
    given, gives = np.array(row.run(row.values, steps)), np.broadcast_to(row.gives, len(steps))
    seen = ~np.isnan(gives)
    np.testing.assert_allclose(given[seen], gives[seen], rtol=1e-6, atol=1e-9)
    for signal, value in row.after.items():
        assert steps[-1][signal, row.joint] == pytest.approx(value, abs=1e-8)


@pytest.mark.parametrize("row", ROWS_OF_LAWS, ids=lambda row: row.effect)
def test_neutral_values_change_nothing_bit_for_bit(row: Row) -> None:
    steps = row.steps()
    assert row.run({}, steps) == [x[row.row, row.joint] for x in row.steps()]
    assert np.array_equal(steps, row.steps(), equal_nan=True)


@pytest.mark.parametrize(
    "row",
    # a stop's damper acts at the start of the step, a spring's torque has its own slope
    [
        row
        for row in ROWS_OF_LAWS
        if row.row in (MEASURED_VELOCITY, CONTROLLER_TORQUE, TORQUE, JOINT_TORQUE)
        and row.effect not in ("joint_stop", "elastic_joint")
    ],
    ids=lambda row: row.effect,
)
def test_the_damping_goes_with_the_slope_of_the_law(row: Row) -> None:
    """The midpoint step needs to know how the torque depends on the speed."""

    def slope(signal: int) -> float:
        """Of the law against a signal; of one that it does not read, none."""
        ends = []
        for change in (-1e-6, 1e-6):
            steps = row.steps()
            steps[-1][signal, row.joint] += change
            ends.append(row.run(row.values, steps)[-1])
        return float(np.nan_to_num((ends[1] - ends[0]) / 2e-6))

    steps = row.steps()
    before = steps[-1][DAMPING, row.joint]
    row.run(row.values, steps)
    expected = before * slope(row.row) - slope(VELOCITY)
    assert steps[-1][DAMPING, row.joint] == pytest.approx(expected, rel=1e-5, abs=1e-4)


# --- effects that change constants -----------------------------------------------------------------------------------

PLACE = Place(joint=2, chain=0, link=2, followers=(3,))
LAST = (0, 3)
MECHANISMS = (
    # effect, values, constant, where, what it becomes
    ("elasticity", {"compliance": 0.05}, "compliance", 2, 0.09),
    ("reflected_inertia", {"excess": 0.002}, "reflected_inertia", 2, 0.005),
    ("coupling_error", {"ratio": 0.1}, "ratio", LAST, 1.1),
    ("coupling_error", {"offset": 0.05}, "offset", LAST, 0.05),
    # 50 g at 20 mm and 150 g at 100 mm, both along (0.6, 0, -0.8): 200 g at 80 mm; a reduced mass 37.5 g, 80 mm apart
    ("payload", {"mass": 0.15, "distance": 0.1}, "mass", LAST, 0.2),
    ("payload", {"mass": 0.15, "distance": 0.1}, "com", LAST, [0.048, 0.0, -0.064]),
    (
        "payload",
        {"mass": 0.15, "distance": 0.1},
        "inertia",
        LAST,
        [[1.636e-4, 0.0, 1.152e-4], [0.0, 2.5e-4, 0.0], [1.152e-4, 0.0, 9.64e-5]],
    ),
    ("payload", {"mass": -0.02, "distance": 0.02}, "mass", LAST, 0.03),
    ("payload", {"mass": -0.2, "distance": 0.02}, "mass", LAST, 1e-6),  # never less than nothing
    ("mount_tilt", {"first": 0.3}, "gravity", (0,), [0.0, 9.81 * sin(0.3), -9.81 * cos(0.3)]),
    ("mount_tilt", {"second": 0.3}, "gravity", (0,), [-9.81 * sin(0.3), 0.0, -9.81 * cos(0.3)]),
)


def constants() -> dict[str, np.ndarray]:
    return {
        "mass": np.full((1, 4), 0.05),
        "com": np.tile([0.012, 0.0, -0.016], (1, 4, 1)),
        "inertia": np.tile(1e-5 * np.eye(3), (1, 4, 1, 1)),
        "ratio": np.ones((1, 4)),
        "offset": np.zeros((1, 4)),
        "reflected_inertia": np.full(3, 0.003),
        "compliance": np.full(3, 0.04),
        "gravity": np.array([[0.0, 0.0, -9.81]]),
    }


@pytest.mark.parametrize(("name", "values", "key", "where", "becomes"), MECHANISMS)
def test_a_mechanism_gets_the_constants_of_the_formula(name, values, key, where, becomes) -> None:
    effect, neutral, changed = catalogue()[name], constants(), constants()
    effect.configure(neutral.__getitem__, PLACE, np.array([p.neutral for p in effect.parameters]))
    effect.configure(changed.__getitem__, PLACE, np.array([values.get(p.name, p.neutral) for p in effect.parameters]))
    assert all(np.array_equal(neutral[one], value) for one, value in constants().items())
    np.testing.assert_allclose(changed[key][where], becomes, rtol=1e-9, atol=1e-15)
    changed[key][where] = constants()[key][where]
    others = ("mass", "com", "inertia") if name == "payload" else ()
    assert all(np.array_equal(changed[one], value) for one, value in constants().items() if one not in others)


def test_a_tilt_goes_with_any_direction_of_gravity_and_with_none() -> None:
    batch = np.array([[[0.0, 0.0, 0.0]], [[0.0, -9.81, 0.0]], [[3.0, 4.0, 0.0]]])
    catalogue()["mount_tilt"].configure({"gravity": batch}.__getitem__, PLACE, np.array([[0.2, 0.1]] * 3))
    sizes = np.linalg.norm(batch[:, 0], axis=1)
    np.testing.assert_allclose(sizes, [0.0, 9.81, 5.0])
    assert batch[1, 0, 1] == pytest.approx(-9.81 * cos(0.2) * cos(0.1))
    assert np.allclose(batch[0], 0.0)


def test_every_parameter_of_every_effect_has_a_row_in_which_it_acts() -> None:
    rows = [(row.effect, row.values) for row in ROWS_OF_LAWS] + [row[:2] for row in MECHANISMS]
    shown = {(name, key) for name, values in rows for key, value in values.items()}
    every = {(name, parameter.name) for name, effect in catalogue().items() for parameter in effect.parameters}
    assert every - shown == set(), "give each a row: parameters, signals and the value that the formula gives"


CARRIAGE = Scales(
    torque=9.4, often=1.35, seldom=112.0, low=-0.116, high=0.1, speed=0.473, command_speed=0.517,
    inertia=7.3, mass=6.63, lever=0.217, time=1.0, slides=True, neighbours=0,
)  # fmt: skip
KP = 40400.0  # [N/m] of that carriage: one tenth of a millimetre of error for 4 N


@pytest.mark.parametrize(("scales", "kp"), [(FINGER, 3.7), (CARRIAGE, KP)], ids=["finger", "carriage"])
def test_a_start_is_a_part_of_the_controllers_own_compliance(scales: Scales, kp: float) -> None:
    ratios = [kp * start["compliance"] for start in Elasticity.starts_at(scales)]
    assert any(0.05 < ratio < 0.5 for ratio in ratios), ratios
    springs = dict.fromkeys(start["compliance"] for start in StiffeningElasticity.starts_at(scales))
    assert list(springs) == pytest.approx([2.0 * start["compliance"] for start in Elasticity.starts_at(scales)])


def test_units_read_as_somebody_with_a_sliding_joint_writes_them() -> None:
    assert unit_at("rad/(N m)", slides=True) == "m/N"
    assert unit_at("N m s/rad", slides=True) == "N s/m"
    assert unit_at("rad/(N m)", slides=False) == "rad/(N m)"


def test_a_rate_limit_starts_about_the_fastest_motion_where_steps_are_faster() -> None:
    speeds = [start["speed"] for start in RateLimit.starts_at(replace(FINGER, speed=5.0, command_speed=150.0))]
    assert speeds == pytest.approx([15.0, 7.5, 4.0, 2.0, 0.75])
    slow = RateLimit.starts_at(replace(FINGER, speed=5.0, command_speed=2.0))
    assert slow[2]["speed"] == pytest.approx(1.6), "of noise"


def test_a_stop_lies_in_its_half_of_the_motion() -> None:
    known = JointStop.parameters_at(replace(FINGER, low=-0.2, high=1.0))
    assert (known["upper"].low, known["lower"].high) == pytest.approx((0.4, 0.4))


def test_a_search_begins_with_little_mass_and_with_that_of_a_counterweight_and_a_tool() -> None:
    starts = Payload.starts_at(replace(FINGER, mass=2.0, lever=0.5))
    assert starts[-2:] == [{"mass": 1.0, "distance": -0.5}, {"mass": 1.0, "distance": 0.5}]
    assert starts[0]["mass"] == -starts[1]["mass"] > 0.0


def test_where_a_joint_slides_it_does_not_matter_how_far_out_the_tool_is() -> None:
    starts = Payload.starts_at(replace(FINGER, mass=2.0, lever=0.5, slides=True))
    assert all(set(one) == {"mass"} for one in starts)


@pytest.mark.parametrize(("speed", "bend"), [(0.0, 0.7), (50.0, 1.0), (-50.0, -1.0)])
def test_bristles_of_an_unknown_past_balance_a_joint_at_rest_and_follow_one_that_moves(speed: float, bend: float):
    """Of 0.07 N m that pull at a joint bristles bear all, as 0.1 N m is the friction's limit."""
    x = np.full((ROWS, 3), nan)
    x[[VELOCITY, FRICTION, TORQUE, JOINT_TORQUE, LOAD, DAMPING], 1] = speed, 0.1, 0.05, 0.03, 0.01, 1.0
    state = np.array([0.0, 1.0])
    catalogue()["presliding_friction"].law(x, 1, np.array([1e-3, 0.0, 0.0]), state, DT)
    assert state == pytest.approx([bend, 0.0])
    assert x[JOINT_TORQUE, 1] == pytest.approx(0.03 - 0.1 * bend)
