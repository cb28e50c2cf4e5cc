"""Commands that arrive late."""

from math import ceil

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import COMMAND

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
