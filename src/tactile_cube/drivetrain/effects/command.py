"""What happens to a command before the controller has it."""

from math import ceil

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

    state_size = 2  # command in force, first-call flag

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


RATES = (0.8, 0.4, 0.15)
"""Limits at which a search starts, as parts of the fastest motion, or of the fastest command where that is slower."""


class RateLimit(Effect):
    """Command that the drive lets change only at a limited speed.

    |dq_d / dt| <= speed.

    In data: an error during fast commands only, which ends some time after them.
    Confused with: `torque_saturation`; `actuator_lag`.
    Source: set-point generators of servo drives.
    """

    name = "rate_limit"
    stage = Stage.COMMAND
    parameters = (
        Parameter(
            "speed", unit="rad/s", neutral=1e9, low=0.02, high=1e9, typical=1.0, source="below the fastest command"
        ),
    )

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return limits below the fastest motion, which follows a limited command; steps are faster than any limit."""
        fastest = min(scales.speed, scales.command_speed)
        return [{"speed": share * fastest} for share in RATES]

    state_size = 2  # limited command, first-call flag

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the command [rad]."""
        if s[1] == 0.0:
            s[0] = x[COMMAND, j]
            s[1] = 1.0
        step = p[0] * dt
        s[0] = s[0] + min(max(x[COMMAND, j] - s[0], -step), step) if abs(x[COMMAND, j] - s[0]) > step else x[COMMAND, j]
        return s[0]


LONGEST = 0.1
"""Longest delay that the state can hold [s]."""
STEPS = 50
"""Least number of steps that the state can hold."""


class CommandDelay(Effect):
    """Command that reaches the controller late.

    q_d(t) = command(t - delay), interpolated between time steps, so that a fit can change the delay smoothly.

    In data: an error proportional to the command's speed; its phase grows linearly with the frequency.
    Confused with: `actuator_lag` and `velocity_filter_lag` in slow motion.
    Source: bus, scheduler and filters of a controller, 2-60 ms.
    """

    name = "command_delay"
    stage = Stage.COMMAND
    parameters = (Parameter("delay", "s", 0.0, 0.0, LONGEST, 0.02, "2-60 ms"),)

    bounded_memory = True

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return the size of: first-call flag, write index, ring of past commands."""
        return 4 + max(STEPS, ceil(LONGEST / dt - 1e-9))

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the command [rad]."""
        length = len(s) - 2
        if s[0] == 0.0:
            s[:] = x[COMMAND, j]
            s[0], s[1] = 1.0, 0.0
        newest = int(s[1])
        s[2 + newest] = x[COMMAND, j]
        s[1] = (newest + 1) % length
        steps = min(max(p[0] / dt, 0.0), length - 2.0)
        whole = int(steps)
        later = s[2 + (newest - whole) % length]
        earlier = s[2 + (newest - whole - 1) % length]
        return later + (steps - whole) * (earlier - later)
