"""What happens to a command before the controller has it, and what the controller adds to its impedance law."""

from math import ceil, exp

from tactile_cube.drivetrain import signals as sig
from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Scales, Stage

DEAD = (0.1, 0.4)  # sizes of a dead zone of the torque at which a search starts, as parts of the usual torque


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
        command = x[sig.COMMAND, j]
        if s[1] == 0.0:
            s[0] = command
            s[1] = 1.0
        if p[2] > 0.0 and abs(command - s[0]) <= p[2]:
            command = s[0]
        command = min(max(s[0], command - p[3]), command + p[3]) if p[3] > 0.0 else command
        s[0] = command
        if p[0] <= 0.0 and p[1] <= 0.0:
            return command
        reading = x[sig.MOTOR_POSITION, j] + dt * x[sig.VELOCITY, j]  # the last step's, extrapolated to this step
        difference = command - reading
        if abs(difference) <= p[1]:
            return reading
        if p[0] > 0.0:
            return command - min(max(difference, -p[0]), p[0])
        return command

    @staticmethod
    def torque_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        if abs(x[sig.TORQUE, j]) < p[4]:
            x[sig.DAMPING, j] = 0.0
        return x[sig.TORQUE, j] - min(max(x[sig.TORQUE, j], -p[4]), p[4])


RATES = (3.0, 1.5, 0.8, 0.4, 0.15)
"""Limits at which a search starts, in units of the usual fastest motion, or command where that is slower."""


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
        """Return limits below the usual fastest motion, which follows limited commands, and one that binds in jumps."""
        fastest = min(scales.speed, scales.command_speed)
        return [{"speed": share * fastest} for share in RATES]

    state_size = 3  # limited command, first-call flag, command wanted before

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the mean of the limited command over a step [rad]."""
        wanted = x[sig.COMMAND_AFTER, j]
        if s[1] == 0.0:
            s[0] = s[2] = wanted
            s[1] = 1.0
        limited, before, step = s[0], s[2], p[0] * dt
        s[2] = wanted
        if abs(wanted - limited) <= step:
            s[0] = wanted
            return x[sig.COMMAND, j] if limited == before else 0.5 * (limited + wanted)
        s[0] = limited + min(max(wanted - limited, -step), step)
        return 0.5 * (limited + s[0])


LONGEST = 0.1  # longest delay that the state can hold [s]
STEPS = 50  # least number of steps that the state can hold


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
        length = len(s) - 2
        if s[0] == 0.0:
            s[:] = x[sig.COMMAND, j]
            s[0], s[1] = 1.0, 0.0
        newest = int(s[1])
        s[2 + newest] = x[sig.COMMAND, j]
        s[1] = (newest + 1) % length
        steps = min(max(p[0] / dt, 0.0), length - 2.0)
        whole = int(steps)
        later = s[2 + (newest - whole) % length]
        earlier = s[2 + (newest - whole - 1) % length]
        return later + (steps - whole) * (earlier - later)


CLAMPS = (0.3, 1.0)  # limits at which a search starts, as parts of the torque that the recording usually asks for


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
            return x[sig.CONTROLLER_TORQUE, j]
        reading = x[sig.MOTOR_POSITION, j] + x[sig.DEFLECTION, j]
        if s[0] == 0.0:
            s[0] = 1.0
            braked = x[sig.DAMPING, j] * x[sig.VELOCITY, j]
            friction = x[sig.FRICTION, j]
            rubbed = friction * braked / (abs(braked) + friction) if friction > 0.0 else 0.0
            s[1] += x[sig.LOAD, j] + rubbed - x[sig.TORQUE, j]
        elif s[0] == 2.0:
            s[0] = 1.0
        else:
            s[1] += p[0] * (0.5 * dt * (s[2] + x[sig.COMMAND, j] - s[3] - reading) - p[2] * (reading - s[3]))
        if p[1] > 0.0:
            s[1] = min(max(s[1], -p[1]), p[1])
        s[2], s[3] = x[sig.COMMAND, j], reading
        return x[sig.CONTROLLER_TORQUE, j] + s[1]


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
        return x[sig.CONTROLLER_TORQUE, j] + p[0] * x[sig.WEIGHT, j]


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
            s[0], s[1] = 1.0, x[sig.COMMAND, j]
        followed = (1.0 - exp(-dt / p[1])) * (x[sig.COMMAND, j] - s[1])
        s[1] += followed
        return x[sig.CONTROLLER_TORQUE, j] + p[0] * followed / dt
