"""What the motor makes of the torque that its controller asks for."""

from collections.abc import Mapping
from math import cos, exp, inf, isfinite, pi, sin
from typing import ClassVar

import numpy as np

from tactile_cube.drivetrain import signals as sig
from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Scales, Simpler, Stage, harmonic, unit_at


class TorqueGain(Effect):
    """Torque constant that differs from the stated one.

    tau *= 1 + error.

    In data: an error proportional to the torque.
    Confused with: `payload` and all inertia together; `load_dependent_friction` under one load; a known weight
    separates.
    Source: tolerance of torque constants and current sensors.
    """

    name = "torque_gain"
    stage = Stage.MOTOR_TORQUE
    parameters = (Parameter("error", unit="1", neutral=0.0, low=-0.8, high=1.0, typical=0.1, source="1-15 %"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        x[sig.DAMPING, j] *= 1.0 + p[0]
        return x[sig.TORQUE, j] * (1.0 + p[0])


SMALLEST = 0.01  # part of `reference` below which the curve is a straight line to zero


class TorqueCurve(Effect):
    """Motor whose torque is not proportional to its command.

    tau = (1 + gain) * reference * |u / reference|^(1 + bend) * sgn u, u the torque asked for. A negative bend gives
    less than proportional torque beyond `reference` and more below it. Servos whose controller sets the duty cycle do
    this, and motors whose iron saturates.

    In data: too much torque for small commands and too little for large ones, or the reverse.
    Confused with: `torque_gain` in motion of one amplitude; `torque_saturation`.
    Source: Duclos et al., BAM: extended friction models for servo actuators, 2025 (duty law); Mohan, Power Electronics,
    2003 (saturation).
    """

    name = "torque_curve"
    stage = Stage.MOTOR_TORQUE
    contains: ClassVar[Simpler] = {"torque_gain": {"bend": 0.0}}
    parameters = (
        Parameter("bend", unit="1", neutral=0.0, low=-0.8, high=1.5, typical=-0.2, source="duty laws: -0.1 to -0.5"),
        Parameter("gain", unit="1", neutral=0.0, low=-0.8, high=1.0, typical=0.0, source="1-15 %"),
        Parameter("reference", unit="N m", neutral=0.15, low=1e-3, high=10.0, typical=0.15, source="usual torque"),
    )

    forms = ({"bend": -0.2, "gain": 0.0},)

    @classmethod
    def placed_at(cls, scales: Scales) -> dict[str, float]:
        """Return the usual torque, at which `bend` changes nothing."""
        return {"reference": scales.torque}

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        if p[0] == 0.0 and p[1] == 0.0:
            return x[sig.TORQUE, j]
        load = abs(x[sig.TORQUE, j]) / p[2]
        factor = (1.0 + p[1]) * max(load, SMALLEST) ** p[0]
        x[sig.DAMPING, j] *= factor * (1.0 + p[0] if load > SMALLEST else 1.0)
        return x[sig.TORQUE, j] * factor


class TorqueBias(Effect):
    """Constant torque that nobody commanded.

    tau += bias.

    In data: a constant error of the torque, at rest too.
    Confused with: `asymmetric_friction` while the joint moves; `payload` in one configuration; `position_offset`.
    Source: offsets of current and torque sensors.
    """

    name = "torque_bias"
    stage = Stage.MOTOR_TORQUE
    parameters = (Parameter("bias", unit="N m", neutral=0.0, low=-0.5, high=0.5, typical=0.005, source="1-10 mN m"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        return x[sig.TORQUE, j] + p[0]


class TorqueCrosstalk(Effect):
    """Part of the neighbours' torque that reaches a joint.

    tau_i += from_previous * tau_(i-1) + from_next * tau_(i+1); the last joint's next one is the first.

    In data: an error proportional to a neighbour's torque.
    Confused with: `joint_coupling`, which follows the neighbour's motion.
    Source: tendons routed over neighbouring joints; cross-coupling of torque sensors.
    """

    name = "torque_crosstalk"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("from_previous", unit="1", neutral=0.0, low=-0.9, high=0.9, typical=0.05, source="1-15 %"),
        Parameter("from_next", unit="1", neutral=0.0, low=-0.9, high=0.9, typical=0.0, source="1-15 %"),
    )

    forms = ({"from_previous": 0.05}, {"from_next": 0.05})

    @classmethod
    def can_act(cls, scales: Scales) -> bool:
        """Return whether the joint has neighbours."""
        return scales.neighbours > 0

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        n = x.shape[1]
        return x[sig.TORQUE, j] + p[0] * x[sig.TORQUE, (j - 1) % n] + p[1] * x[sig.TORQUE, (j + 1) % n]


RIPPLE = "1-5 % of the rating"
REPEATS = 1.5  # periods in the range of motion from which a ripple is seen to repeat
OVERTONES = ("sine_2", "cosine_2", "sine_3", "cosine_3")


class Cogging(Effect):
    """Torque ripple that repeats with the position.

    tau += sine * sin(harmonic q) + cosine * cos(harmonic q) in the motor; `joint_sine` and `joint_cosine` act at the
    joint instead. A ripple of the motor also bends the drive's elasticity; one of a gear's last stage or of a bearing
    does not. Waves of twice and three times the harmonic act where the first one does.

    In data: a comb over the position, not over time.
    Confused with: `transmission_error`, which needs no torque; slow motion both ways at two loads separates them.
    Source: Holtz and Springob, Identification and compensation of torque ripple, 1996.
    """

    name = "cogging"
    stage = Stage.JOINT_TORQUE
    parameters = (
        Parameter("sine", unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.01, source=RIPPLE),
        Parameter("cosine", unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.0, source=RIPPLE),
        harmonic(source="poles times gear ratio"),
        Parameter("joint_sine", unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.0, source=RIPPLE),
        Parameter("joint_cosine", unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.0, source=RIPPLE),
        *(
            Parameter(name, unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.0, source="slots, saturation")
            for name in OVERTONES
        ),
    )

    forms = (
        {"sine": 0.01, "cosine": 0.0, "harmonic": 10.0},
        {"joint_sine": 0.01, "joint_cosine": 0.0, "harmonic": 10.0},
    )
    details = OVERTONES

    @classmethod
    def details_at(cls, scales: Scales, values: Mapping[str, float]) -> tuple[str, ...]:
        """Return the overtones if the ripple repeats in the motion; three waves fit any torque that does not repeat."""
        repeats = values["harmonic"] * scales.span / (2.0 * pi)
        return cls.details if repeats >= REPEATS else ()

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        angle = p[2] * x[sig.ANGLE, j]
        if p[3] == 0.0 and p[4] == 0.0:
            return x[sig.JOINT_TORQUE, j]
        ripple = p[3] * sin(angle) + p[4] * cos(angle)
        ripple += p[5] * sin(2 * angle) + p[6] * cos(2 * angle) + p[7] * sin(3 * angle) + p[8] * cos(3 * angle)
        return x[sig.JOINT_TORQUE, j] + ripple

    @staticmethod
    def torque_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        angle = p[2] * x[sig.ANGLE, j]
        ripple = p[0] * sin(angle) + p[1] * cos(angle)
        if p[3] == 0.0 and p[4] == 0.0:
            ripple += p[5] * sin(2 * angle) + p[6] * cos(2 * angle) + p[7] * sin(3 * angle) + p[8] * cos(3 * angle)
        return x[sig.TORQUE, j] + ripple


class ActuatorLag(Effect):
    """Motor torque that follows the torque asked for with a first-order lag.

    time_constant * s' = tau - s; the torque s reaches the joint.

    In data: a delay in slow motion; fast motion loses amplitude too.
    Confused with: `command_delay` below 1 / (2 pi time_constant); `reflected_inertia`.
    Source: torque loops and tendons, 5-100 ms (Shadow hand: 54 ms).
    """

    name = "actuator_lag"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("time_constant", unit="s", neutral=0.0, low=0.0, high=0.3, typical=0.01, source="5-100 ms"),
    )

    state_size = 4  # delivered torque, first-call flag, last torque asked for and its share in the delivered one

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m], exact for an input that is linear from step to step.

        The torque asked for depends on the speed in the middle of a step. The last step's state is moved to its end
        before it is used.
        """
        asked = x[sig.TORQUE, j]
        if p[0] <= 0.0:
            return asked
        if s[1] == 0.0:
            s[0] = asked
            s[1] = 1.0
            s[2] = asked
        later = 0.5 * dt * x[sig.DAMPING, j] * x[sig.ACCELERATION, j]
        s[0] -= s[3] * later
        s[2] -= later
        kept = exp(-dt / p[0])
        mean = (1.0 - kept) * p[0] / dt
        x[sig.DAMPING, j] *= 1.0 - mean
        s[0] = kept * s[0] + (mean - kept) * s[2] + (1.0 - mean) * asked
        s[2] = asked
        s[3] = 1.0 - mean
        return s[0]


LEVELS = 9  # number of limits at which a search starts, from the median torque to the largest ones in equal factors

REACHED = 0.9  # share of the stated limit from which it counts as reached: limits of drives vary by a tenth

HARD = 0.02  # A softness up to this counts as none: the torque is within 1.4 % of the limit, and larger powers overflow


class TorqueSaturation(Effect):
    """Torque limit below the stated one.

    |tau| <= limit. With a softness s > 0, tau = u / (1 + |u / limit|^(1 / s))^s approaches the limit; u is the torque
    asked for.

    In data: an error only where much torque is asked for.
    Confused with: `rate_limit`; `torque_curve`.
    Source: current limits of drives; saturating iron approaches its torque softly (0.4 is close to a tanh).
    """

    name = "torque_saturation"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("limit", "N m", 1e9, 0.005, 1e9, 0.1, "a fraction of the stated limit", scale=0.02),
        Parameter(
            "softness", unit="1", neutral=0.0, low=0.0, high=1.0, typical=0.0, source="0 hard, 0.4 tanh", scale=0.2
        ),
    )
    details = ("softness",)
    detail_starts: ClassVar[Mapping[str, float]] = {"softness": 0.3}

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return limits among the torques that the recording asks for."""
        return [{"limit": float(level)} for level in np.geomspace(scales.often, scales.seldom, LEVELS)]

    @classmethod
    def unseen_at(cls, scales: Scales) -> str | None:
        """Return the largest torque asked for, if it is below the stated limit: a limit above it does nothing."""
        if not isfinite(scales.torque_limit) or scales.seldom > REACHED * scales.torque_limit:
            return None
        return f"asked for up to {scales.seldom:.3g} of {scales.torque_limit:.3g} {unit_at('N m', scales.slides)}"

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        if p[1] > HARD:
            asked = 1.0 + abs(x[sig.TORQUE, j] / p[0]) ** (1.0 / p[1])
            x[sig.DAMPING, j] *= asked ** -(p[1] + 1.0)
            return x[sig.TORQUE, j] * asked ** -p[1]
        if abs(x[sig.TORQUE, j]) > p[0]:
            x[sig.DAMPING, j] = 0.0
        return min(max(x[sig.TORQUE, j], -p[0]), p[0])


UNLIMITED = 1e9  # neutral value of `stall`: a supply that is never too weak
FASTER = (1.2, 2.5)  # No-load speeds at which a search starts, as multiples of the largest speed of the recording


class BackEmf(Effect):
    """Motor whose torque falls with its speed: back-EMF eats up the voltage of the supply.

    -stall * (1 + dq / no_load) <= tau <= stall * (1 - dq / no_load): what the supply can drive through the winding of a
    DC motor, whose current a loop controls below that. `stall` is the largest torque at rest, `no_load` the speed at
    which no torque is left. A drive that sets the voltage and not the current loses stall / no_load * dq at any torque:
    that is `viscous_friction`, with `torque_saturation` at the stall torque.

    In data: fast motion falls short of its command, and only where it takes much torque.
    Confused with: `torque_saturation`, `rate_limit`; `viscous_friction` in motion at the limit alone.
    Source: the torque-speed line of any DC motor's data sheet.
    """

    name = "back_emf"
    stage = Stage.MOTOR_TORQUE
    contains: ClassVar[Simpler] = {"torque_saturation": {"no_load": inf}}
    parameters = (
        Parameter("stall", "N m", UNLIMITED, 0.005, UNLIMITED, 0.2, "data sheet", scale=0.02),
        Parameter("no_load", "rad/s", 10.0, 0.5, 1e3, 5.0, "data sheet"),
    )

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return stall torques from the recording's usual torque to twice its largest, at two no-load speeds."""
        levels = np.geomspace(scales.torque, 2.0 * scales.seldom, 3)
        return [{"stall": float(level), "no_load": times * scales.speed} for level in levels for times in FASTER]

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        if p[0] >= UNLIMITED:
            return x[sig.TORQUE, j]
        slope = p[0] / p[1]
        lost = slope * x[sig.VELOCITY, j]
        torque = min(max(x[sig.TORQUE, j], -p[0] - lost), p[0] - lost)
        if torque != x[sig.TORQUE, j]:
            x[sig.DAMPING, j] = slope
        return torque
