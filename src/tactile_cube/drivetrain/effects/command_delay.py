"""Commands that arrive late: bus, scheduler, filter without lag."""

from math import ceil

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import COMMAND

LONGEST = 0.1
"""Longest delay that is remembered [s], if it is not less than so many steps."""
STEPS = 50


class CommandDelay(Effect):
    """u(t - Td), interpolated between steps so that the delay can be fitted smoothly.

    State: [1 after the first call, write index, ring of past commands].
    """

    name = "command_delay"
    stage = Stage.COMMAND
    parameters = (Parameter("delay", "s", 0.0, 0.0, LONGEST, 0.02, "2-60 ms"),)

    @classmethod
    def state_size(cls, dt: float) -> int:  # noqa: D102
        return 4 + max(STEPS, ceil(LONGEST / dt - 1e-9))

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:  # noqa: D102
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
