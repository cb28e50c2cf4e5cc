"""A controller that integrates its position error."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import (
    COMMAND,
    DAMPING,
    DEFLECTION,
    FRICTION,
    LOAD,
    MOTOR_POSITION,
    TORQUE,
    VELOCITY,
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
