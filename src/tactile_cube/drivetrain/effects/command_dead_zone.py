"""A command that is ignored while it asks for little."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import COMMAND, DAMPING, MOTOR_POSITION, TORQUE, VELOCITY

DEAD = (0.1, 0.4)
"""Parts of the usual torque at which a dead zone of the torque starts."""


class CommandDeadZone(Effect):
    """Dead zones in the five forms that drives have.

    error: control errors below it are ignored, larger ones reduced by it. gate: control errors below it are
    ignored, larger ones act in full. hold: a new command is taken only when it differs by more than this from the
    one in force. play: the command in force trails the sent one by this. torque: commanded torques below it are
    ignored, larger ones reduced by it.
    Source: dead bands of servo drives; Tao and Kokotovic, Adaptive control with actuator nonlinearities, 1996.
    """

    name = "command_dead_zone"
    stage = Stage.COMMAND
    parameters = (
        Parameter("error", unit="rad", neutral=0.0, low=0.0, high=0.2, typical=0.005, source="0.1-1 deg"),
        Parameter("gate", unit="rad", neutral=0.0, low=0.0, high=0.2, typical=0.0, source="0.1-1 deg"),
        Parameter("hold", unit="rad", neutral=0.0, low=0.0, high=0.2, typical=0.0, source="0.1-1 deg"),
        Parameter("play", unit="rad", neutral=0.0, low=0.0, high=0.2, typical=0.0, source="0.1-1 deg"),
        Parameter("torque", unit="N m", neutral=0.0, low=0.0, high=1.0, typical=0.0, source="1-10 % of the rating"),
    )

    forms = (
        {"error": 0.005},
        {"gate": 0.005},
        {"hold": 0.005},
        {"play": 0.005},
        {"torque": 0.01},
    )

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """The forms; that of the torque at parts of the usual torque."""
        others = [form for form in super().starts_at(scales) if "torque" not in form]
        return [*others, *({"torque": share * scales.torque} for share in DEAD)]

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Command in force, first-call flag."""
        return 2

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Command [rad]."""
        command = x[COMMAND, j]
        if s[1] == 0.0:
            s[0] = command
            s[1] = 1.0
        if p[2] > 0.0 and abs(command - s[0]) <= p[2]:
            command = s[0]
        command = min(max(s[0], command - p[3]), command + p[3]) if p[3] > 0.0 else command
        s[0] = command
        if p[0] <= 0.0 and p[1] <= 0.0:
            return command
        reading = x[MOTOR_POSITION, j] + dt * x[VELOCITY, j]  # that of the last step, carried on to this one
        difference = command - reading
        if abs(difference) <= p[1]:
            return reading
        if p[0] > 0.0:
            return command - min(max(difference, -p[0]), p[0])
        return command

    @staticmethod
    def torque_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Motor torque [N m]."""
        if abs(x[TORQUE, j]) < p[4]:
            x[DAMPING, j] = 0.0
        return x[TORQUE, j] - min(max(x[TORQUE, j], -p[4]), p[4])
