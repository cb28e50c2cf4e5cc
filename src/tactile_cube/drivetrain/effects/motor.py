"""From the controller's torque to the motor's."""

from collections.abc import Mapping
from math import cos, exp, isfinite, pi, sin

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage, harmonic
from tactile_cube.drivetrain.effects.scales import Scales, unit_at
from tactile_cube.drivetrain.signals import (
    ACCELERATION,
    ANGLE,
    COMMAND,
    DAMPING,
    DEFLECTION,
    FRICTION,
    JOINT_TORQUE,
    LOAD,
    MOTOR_POSITION,
    TORQUE,
    VELOCITY,
    WEIGHT,
)

CLAMPS = (0.3, 1.0)
"""Limits at which a search starts, as parts of the torque that the recording usually asks for."""


class IntegralAction(Effect):
    """Controller that integrates its position error (the I of a PID).

    tau += s with s' = ki * (q_d - q_m), kept within +-limit (anti-windup clamp) unless that is zero. The integral
    begins at the torque that holds the joint where it starts.

    In data: at rest the error creeps to zero, however heavy the load; motion overshoots and swings back slowly.
    Confused with: `gravity_compensation` in slow motion; `torque_bias`.
    Source: Astrom and Murray, Feedback Systems, 2008, ch. 10.
    """

    name = "integral_action"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("ki", "N m/(rad s)", 0.0, 0.0, 200.0, 5.0, "kp over 0.1 to 2 s"),
        Parameter("limit", "N m", 0.0, 0.0, 10.0, 0.0, "none, or a part of the torque limit", scale=0.02),
    )
    forms = ({"ki": 5.0}, {"ki": 5.0, "limit": 0.15})

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return the integral without a clamp, and with clamps among the torques that the recording asks for."""
        plain, _ = cls.forms_at(scales)
        return [plain, *({**plain, "limit": share * scales.torque} for share in CLAMPS)]

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 4: first-call flag, integral, last command and last reading."""
        return 4

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]; the command counts as held over a step, the reading as linear."""
        if p[0] <= 0.0:
            return x[TORQUE, j]
        reading = x[MOTOR_POSITION, j] + x[DEFLECTION, j]
        if s[0] == 0.0:
            s[0] = 1.0
            braked = x[DAMPING, j] * x[VELOCITY, j]
            rubbed = x[FRICTION, j] * braked / (abs(braked) + x[FRICTION, j]) if x[FRICTION, j] > 0.0 else 0.0
            s[1] = x[LOAD, j] + rubbed - x[TORQUE, j]
        else:
            s[1] += p[0] * dt * (s[2] - 0.5 * (s[3] + reading))
        if p[1] > 0.0:
            s[1] = min(max(s[1], -p[1]), p[1])
        s[2], s[3] = x[COMMAND, j], reading
        return x[TORQUE, j] + s[1]


class GravityCompensation(Effect):
    """Controller that carries a part of the links' weight by itself.

    tau += share * g(q), where g is the torque that holds the model's links against gravity at their posture.

    In data: the joint sags less than its weight and its stiffness say, in every posture.
    Confused with: `payload`: less load than stated, or a counterweight; a torque sensor separates them. `mount_tilt`,
    `torque_gain` in slow motion.
    Source: Takegaki and Arimoto, A new feedback method for dynamic control of manipulators, 1981 (PD with gravity
    compensation).
    """

    name = "gravity_compensation"
    stage = Stage.MOTOR_TORQUE
    weighs = True
    parameters = (Parameter("share", "1", 0.0, -0.5, 1.5, 0.8, "0 none, 1 all of it"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        return x[TORQUE, j] + p[0] * x[WEIGHT, j]


class VelocityFeedforward(Effect):
    """Controller that adds a torque in proportion to the speed of its command.

    tau += gain * (q_d - f) / smoothing with smoothing * f' = q_d - f: the command's speed through a low-pass, for
    commands jump. A controller that damps the error of the speed, K_D (dq_d - dq), has a gain of K_D.

    In data: the joint lags less behind a moving command than its gains say; no change at rest.
    Confused with: a command that is logged late; the opposite of `command_delay`.
    Source: Craig, Introduction to Robotics, ch. 10; the velocity feed-forward of any servo drive.
    """

    name = "velocity_feedforward"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("gain", "N m s/rad", 0.0, 0.0, 2.0, 0.1, "up to K_D"),
        Parameter("smoothing", "s", 0.005, 1e-4, 0.1, 0.005, "1-20 ms"),
    )
    forms = ({"gain": 0.1},)
    details = ("smoothing",)

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 2: first-call flag and smoothed command."""
        return 2

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]: its mean over a step of a command that is held."""
        if s[0] == 0.0:
            s[0], s[1] = 1.0, x[COMMAND, j]
        followed = (1.0 - exp(-dt / p[1])) * (x[COMMAND, j] - s[1])
        s[1] += followed
        return x[TORQUE, j] + p[0] * followed / dt


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
        """Return the motor torque [N m]."""
        x[DAMPING, j] *= 1.0 + p[0]
        return x[TORQUE, j] * (1.0 + p[0])


SMALLEST = 0.01
"""Part of `reference` below which the curve is a straight line to zero."""


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
    contains = ("torque_gain",)
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
        """Return the motor torque [N m]."""
        if p[0] == 0.0 and p[1] == 0.0:
            return x[TORQUE, j]
        load = abs(x[TORQUE, j]) / p[2]
        factor = (1.0 + p[1]) * max(load, SMALLEST) ** p[0]
        x[DAMPING, j] *= factor * (1.0 + p[0] if load > SMALLEST else 1.0)
        return x[TORQUE, j] * factor


class TorqueBias(Effect):
    """Constant torque that nobody commanded.

    tau += bias.

    In data: a constant error of the torque, at rest too.
    Confused with: `asymmetric_friction` while the joint moves; `payload` in one posture; `position_offset`.
    Source: offsets of current and torque sensors.
    """

    name = "torque_bias"
    stage = Stage.MOTOR_TORQUE
    parameters = (Parameter("bias", unit="N m", neutral=0.0, low=-0.5, high=0.5, typical=0.005, source="1-10 mN m"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        return x[TORQUE, j] + p[0]


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
        """Return the motor torque [N m]."""
        n = x.shape[1]
        return x[TORQUE, j] + p[0] * x[TORQUE, (j - 1) % n] + p[1] * x[TORQUE, (j + 1) % n]


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
        """Return the joint torque [N m]."""
        angle = p[2] * x[ANGLE, j]
        if p[3] == 0.0 and p[4] == 0.0:
            return x[JOINT_TORQUE, j]
        ripple = p[3] * sin(angle) + p[4] * cos(angle)
        ripple += p[5] * sin(2 * angle) + p[6] * cos(2 * angle) + p[7] * sin(3 * angle) + p[8] * cos(3 * angle)
        return x[JOINT_TORQUE, j] + ripple

    @staticmethod
    def torque_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        angle = p[2] * x[ANGLE, j]
        ripple = p[0] * sin(angle) + p[1] * cos(angle)
        if p[3] == 0.0 and p[4] == 0.0:
            ripple += p[5] * sin(2 * angle) + p[6] * cos(2 * angle) + p[7] * sin(3 * angle) + p[8] * cos(3 * angle)
        return x[TORQUE, j] + ripple


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

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 4: delivered torque, first-call flag, last torque asked for and its share in the delivered one."""
        return 4

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m], exact for an input that is linear from step to step.

        The torque asked for depends on the speed in the middle of a step. The last step's state is moved to its end
        before it is used.
        """
        asked = x[TORQUE, j]
        if p[0] <= 0.0:
            return asked
        if s[1] == 0.0:
            s[0] = asked
            s[1] = 1.0
            s[2] = asked
        later = 0.5 * dt * x[DAMPING, j] * x[ACCELERATION, j]
        s[0] -= s[3] * later
        s[2] -= later
        kept = exp(-dt / p[0])
        mean = (1.0 - kept) * p[0] / dt
        x[DAMPING, j] *= 1.0 - mean
        s[0] = kept * s[0] + (mean - kept) * s[2] + (1.0 - mean) * asked
        s[2] = asked
        s[3] = 1.0 - mean
        return s[0]


LEVELS = 9
"""Number of limits at which a search starts, from the median torque to the largest ones in equal factors."""

REACHED = 0.9
"""Share of the stated limit from which it counts as reached: limits of drives vary by a tenth."""

HARD = 0.02
"""A softness up to this counts as none: the torque is within 1.4 % of the limit, and larger powers overflow."""


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
        """Return the motor torque [N m]."""
        if p[1] > HARD:
            asked = 1.0 + abs(x[TORQUE, j] / p[0]) ** (1.0 / p[1])
            x[DAMPING, j] *= asked ** -(p[1] + 1.0)
            return x[TORQUE, j] * asked ** -p[1]
        if abs(x[TORQUE, j]) > p[0]:
            x[DAMPING, j] = 0.0
        return min(max(x[TORQUE, j], -p[0]), p[0])


UNLIMITED = 1e9
"""Neutral value of `stall`: a supply that is never too weak."""
FASTER = (1.2, 2.5)
"""No-load speeds at which a search starts, as multiples of the largest speed of the recording."""


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
    contains = ("torque_saturation",)
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
        """Return the motor torque [N m]."""
        if p[0] >= UNLIMITED:
            return x[TORQUE, j]
        slope = p[0] / p[1]
        lost = slope * x[VELOCITY, j]
        torque = min(max(x[TORQUE, j], -p[0] - lost), p[0] - lost)
        if torque != x[TORQUE, j]:
            x[DAMPING, j] = slope
        return torque
