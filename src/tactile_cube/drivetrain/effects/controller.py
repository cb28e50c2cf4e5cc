"""What a controller adds to the torque of its impedance law, before it limits the sum."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import (
    COMMAND,
    CONTROLLER_TORQUE,
    DAMPING,
    DEFLECTION,
    FRICTION,
    LOAD,
    MOTOR_POSITION,
    TORQUE,
    VELOCITY,
    WEIGHT,
)

CLAMPS = (0.3, 1.0)
"""Limits at which a search starts, as parts of the torque that the recording usually asks for."""


class IntegralAction(Effect):
    """Controller that integrates its error: the I of a PID, or of the speed loop in a cascade (P-PI).

    tau += s with s' = ki * (q_d - q_m - lag * dq_m), kept within +-limit (anti-windup clamp) unless that is zero. The
    lag is 0 in a PID, K_D / K_P in a cascade. The integral begins at the torque that holds the joint where it starts.

    In data: at rest the error creeps to zero, however heavy the load; motion overshoots and swings back slowly.
    Confused with: `gravity_compensation` in slow motion; `torque_bias`.
    Source: Astrom and Murray, Feedback Systems, 2008, ch. 10.
    """

    name = "integral_action"
    stage = Stage.CONTROLLER
    chosen_starts = 1
    parameters = (
        Parameter("ki", "N m/(rad s)", 0.0, 0.0, 200.0, 5.0, "kp over 0.1 to 2 s"),
        Parameter("limit", "N m", 0.0, 0.0, 10.0, 0.0, "none, or a part of the torque limit", scale=0.02),
        Parameter("lag", "s", 0.0, 0.0, 0.5, 0.0, "0 in a PID, K_D / K_P in a cascade", scale=0.01),
    )
    forms = ({"ki": 5.0}, {"ki": 5.0, "limit": 0.15}, {"ki": 5.0, "lag": 0.05})

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return the integral alone, with clamps among the torques that the recording asks for, and in a cascade."""
        plain, _, cascade = cls.forms_at(scales)
        return [plain, *({**plain, "limit": share * scales.torque} for share in CLAMPS), cascade]

    state_size = 4  # 0 to begin in balance, 2 as it is, else 1; integral, last command and last reading

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the torque asked for [N m]; the error counts as linear over a step."""
        if p[0] <= 0.0:
            return x[CONTROLLER_TORQUE, j]
        reading = x[MOTOR_POSITION, j] + x[DEFLECTION, j]
        if s[0] == 0.0:
            s[0] = 1.0
            braked = x[DAMPING, j] * x[VELOCITY, j]
            rubbed = x[FRICTION, j] * braked / (abs(braked) + x[FRICTION, j]) if x[FRICTION, j] > 0.0 else 0.0
            s[1] += x[LOAD, j] + rubbed - x[TORQUE, j]
        elif s[0] == 2.0:
            s[0] = 1.0
        else:
            s[1] += p[0] * (0.5 * dt * (s[2] + x[COMMAND, j] - s[3] - reading) - p[2] * (reading - s[3]))
        if p[1] > 0.0:
            s[1] = min(max(s[1], -p[1]), p[1])
        s[2], s[3] = x[COMMAND, j], reading
        return x[CONTROLLER_TORQUE, j] + s[1]


class GravityCompensation(Effect):
    """Controller that carries a part of the links' weight by itself.

    tau += share * g(q), where g is the torque that holds the model's links against gravity where they are.

    In data: the joint sags less than its weight and its stiffness say, in every configuration.
    Confused with: `payload`: less load than stated, or a counterweight; a torque sensor separates them. `mount_tilt`,
    `torque_gain` in slow motion.
    Source: Takegaki and Arimoto, A new feedback method for dynamic control of manipulators, 1981 (PD with gravity
    compensation).
    """

    name = "gravity_compensation"
    stage = Stage.CONTROLLER
    weighs = True
    parameters = (Parameter("share", "1", 0.0, -0.5, 1.5, 0.8, "0 none, 1 all of it"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the torque asked for [N m]."""
        return x[CONTROLLER_TORQUE, j] + p[0] * x[WEIGHT, j]


class VelocityFeedforward(Effect):
    """Controller that adds a torque in proportion to the speed of its command.

    tau += gain * (q_d - f) / smoothing with smoothing * f' = q_d - f: the command's speed through a low-pass, for
    commands jump. A controller that damps the error of the speed, K_D (dq_d - dq), has a gain of K_D.

    In data: the joint lags less behind a moving command than its gains say; no change at rest.
    Confused with: a command that is logged late; the opposite of `command_delay`.
    Source: Craig, Introduction to Robotics, ch. 10; the velocity feed-forward of any servo drive.
    """

    name = "velocity_feedforward"
    stage = Stage.CONTROLLER
    parameters = (
        Parameter("gain", "N m s/rad", 0.0, 0.0, 2.0, 0.1, "up to K_D"),
        Parameter("smoothing", "s", 0.005, 1e-4, 0.1, 0.005, "1-20 ms"),
    )
    forms = ({"gain": 0.1},)
    details = ("smoothing",)

    state_size = 2  # first-call flag and smoothed command

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the torque asked for [N m]: its mean over a step of a command that is held."""
        if s[0] == 0.0:
            s[0], s[1] = 1.0, x[COMMAND, j]
        followed = (1.0 - exp(-dt / p[1])) * (x[COMMAND, j] - s[1])
        s[1] += followed
        return x[CONTROLLER_TORQUE, j] + p[0] * followed / dt
