"""A command or torque that is ignored while it is small."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import COMMAND, DAMPING, MOTOR_POSITION, TORQUE, VELOCITY

DEAD = (0.1, 0.4)
"""Sizes of a dead zone of the torque at which a search starts, as parts of the usual torque."""


class CommandDeadZone(Effect):
    """Dead zone of the command or of the torque, in the five forms that drives have.

    - `error`: smaller control errors are ignored, larger ones are reduced by it.
    - `gate`: smaller control errors are ignored, larger ones act in full.
    - `hold`: a new command is taken only if it differs by more than this from the one in force.
    - `play`: the command in force trails the command sent by this.
    - `torque`: smaller torques are ignored, larger ones are reduced by it.

    In data: small commands move nothing; large ones fall short by a constant.
    Confused with: `coulomb_friction`; the dead zone does not depend on the load.
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

    forms = ({"error": 0.005}, {"gate": 0.005}, {"hold": 0.005}, {"play": 0.005}, {"torque": 0.01})

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return the forms; that of the torque at parts of the usual torque."""
        others = [form for form in super().starts_at(scales) if "torque" not in form]
        return [*others, *({"torque": share * scales.torque} for share in DEAD)]

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 2: command in force, first-call flag."""
        return 2

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the command [rad]."""
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
        reading = x[MOTOR_POSITION, j] + dt * x[VELOCITY, j]  # the last step's, extrapolated to this step
        difference = command - reading
        if abs(difference) <= p[1]:
            return reading
        if p[0] > 0.0:
            return command - min(max(difference, -p[0]), p[0])
        return command

    @staticmethod
    def torque_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        if abs(x[TORQUE, j]) < p[4]:
            x[DAMPING, j] = 0.0
        return x[TORQUE, j] - min(max(x[TORQUE, j], -p[4]), p[4])
