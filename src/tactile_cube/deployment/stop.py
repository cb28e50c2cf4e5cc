"""How the commands to a robot end: at the last accepted angles, where the fingers press on nothing."""

import time
from collections.abc import Callable
from enum import StrEnum
from typing import cast

import numpy as np

from tactile_cube.deployment.command_guard import CommandGuard
from tactile_cube.deployment.robot import Array, Reading, Robot

REPEATS = 100
"""Commands at the goal that the robot takes before it is let alone, so that a lost message does no harm."""
LOOKING = 0.2
"""How long new measurements are awaited after a gap [s]."""
PERIOD = 0.001
"""Shortest time between two commands [s]."""


class StopError(RuntimeError):
    """The fingers may still press: the robot did not take the commands that end it."""


class Phase(StrEnum):
    """What the stop is doing."""

    LOOKING = "looking"  # commands ceased for so long that the fingers may be elsewhere; nothing is sent
    RETURNING = "returning"  # the commands go to the goal
    RESTING = "resting"  # the last command asks for no torque; it is repeated
    OVER = "over"


class Stop:
    """The last commands, by the clock of this computer, in steps that are bounded whatever the robot's clock says.

    The goal is the last accepted angles, within the joints' range. Who drives it gives what `command` returns to the
    robot and calls `sent` if the robot took it, or gives it measurements by `look` while it returns None.

    Attributes:
        phase: see `Phase`.
        failure: once it is over, why the fingers may still press; "" if they do not.
    """

    def __init__(self, guard: CommandGuard) -> None:
        self._guard, self.clock, self.failure = guard, guard.clock, ""
        self._fresh, self._offered = guard, guard.command
        self._repeats, self._since = 0, -np.inf
        self.phase = Phase.OVER if guard.command is None else Phase.RETURNING
        if self.phase is Phase.RETURNING:
            away = float(np.max(np.abs(self._away())))
            self._ends = self.clock() + guard.rules.patience + 2.0 * away / guard.limits.rate

    @property
    def torque(self) -> float:
        """Largest spring torque K_P |q_d - q_m| of the last command that the robot took, q_m at the goal [N m]."""
        return float(np.max(self._guard.limits.kp * np.abs(self._away())))

    def command(self) -> Array | None:
        """Return the next command `(joints,)` [rad]; None while measurements are awaited, and when it is over."""
        now, guard = self.clock(), self._guard
        if self.phase is not Phase.OVER and now > self._ends:
            self._end()
        elif self.phase is Phase.LOOKING and now - self._since > LOOKING:
            self.phase, self._since = Phase.RETURNING, now
        elif self.phase is not Phase.LOOKING and now - max(guard.sent_at, self._since) > guard.rules.timeout:
            self.phase, self._since = Phase.LOOKING, now
            self._fresh = CommandGuard(guard.limits, guard.rules, guard.names, guard.clock)
        if self.phase in (Phase.LOOKING, Phase.OVER):
            return None
        self._offered = guard.checked(now - guard.sent_at, self._goal())
        return self._offered.copy()

    def sent(self) -> None:
        """Take note that the robot took the last command."""
        assert self._offered is not None
        self._guard.sent(np.nan, self._offered)
        self.phase = Phase.RESTING if self.torque <= self._guard.rules.tolerance else Phase.RETURNING
        self._repeats = self._repeats + 1 if self.phase is Phase.RESTING else 0
        if self._repeats >= REPEATS:
            self._end()

    def look(self, now: float, reading: Reading | None) -> None:
        """Take a measurement while looking; as many as agree at the beginning of a run give the goal anew."""
        if reading is not None:
            self._fresh.accept(now, reading)
        if self._fresh.ready:
            self._guard.state, self.phase, self._since = self._fresh.state, Phase.RETURNING, self.clock()

    def _goal(self) -> Array:
        assert self._guard.state is not None  # as a command has been sent
        return np.clip(self._guard.state.q_m, self._guard.limits.lower, self._guard.limits.upper)

    def _away(self) -> Array:
        assert self._guard.command is not None
        return np.asarray(self._guard.command - self._goal())

    def _end(self) -> None:
        self.phase, torque = Phase.OVER, self._guard.limits.kp * np.abs(self._away())
        if not self._repeats:
            at = int(np.argmax(torque))
            self.failure = (
                f"{self._guard.names[at]} may still press with {torque[at]:.2f} N m: the robot did not take the "
                f"commands that end it within {self._guard.rules.patience:g} s; switch its drives off"
            )


def let_go(stop: Stop, robot: Robot, alive: Callable[[], None]) -> None:
    """Drive a stop to its end, whatever the robot's methods raise; `alive` is called at each step.

    Raises:
        StopError: the fingers may still press.
        BaseException: what `robot.wait` raised; the stop came to its end by sleeping in its place.
    """
    now, lost, broken = np.nan, cast(BaseException | None, None), cast(BaseException | None, None)
    while stop.phase is not Phase.OVER:
        alive()
        began = stop.clock()
        try:
            command = stop.command()
            if command is not None:
                robot.send(command)
                stop.sent()
            elif stop.phase is Phase.LOOKING:
                stop.look(now, robot.read())
        except BaseException as error:  # the next message may get through
            lost = error
        try:
            now = now if broken else robot.wait()
        except BaseException as error:
            broken = error
        time.sleep(max(0.0, PERIOD - (stop.clock() - began)))
    if stop.failure:
        raise StopError(stop.failure) from lost or broken
    if broken:
        raise broken
