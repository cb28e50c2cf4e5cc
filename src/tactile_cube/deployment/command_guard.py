"""Final check of every command to a robot, and the stop sequence that lets the fingers go."""

import time
from collections.abc import Callable
from enum import StrEnum
from math import nan
from typing import cast

import numpy as np
from numpy.typing import NDArray

from tactile_cube.deployment.robot import Array, JointLimits, Reading, Robot, StopRules

AGREEING = 5  # readings in a row that must agree before the first command
ROUNDING = 1e-9  # [rad] of angles that add up ticks


class CommandGuard:
    """Accepts only plausible readings, and returns only commands within the limits.

    Every command is finite, within the range, at most rate * dt away from the one before, and at most torque / K_P
    away from the last accepted angles. A reading around which no such command exists is not accepted.

    Args:
        limits: of every command.
        rules: what a measurement may be.
        names: of the joints.
        clock: monotonic, of this computer [s].

    Attributes:
        state: last accepted reading; before the first command the newest of those that agree.
        command: last command that the robot took `(joints,)` [rad].
        sent_at: when it did so, by `clock` [s].
    """

    def __init__(
        self, limits: JointLimits, rules: StopRules, names: tuple[str, ...], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.limits, self.rules, self.names, self.clock = limits, rules, names, clock
        self._reach = limits.reach
        self.state: Reading | None = None
        self.command: Array | None = None
        self.sent_at = self._sent = nan
        self._agreeing = 0

    @property
    def ready(self) -> bool:
        """Whether enough readings in a row agree for commands to begin."""
        return self._agreeing >= AGREEING

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Joints whose command demands the whole torque limit `(joints,)`."""
        if self.state is None or self.command is None:
            return np.zeros(len(self.names), dtype=bool)
        return np.asarray(np.abs(self.command - self.state.q_m) > 0.99 * self._reach)

    def accept(self, now: float, reading: Reading) -> str:
        """Accept a reading as the state; return "", or why it is rejected; `now` is on the robot's clock [s]."""
        q_m = np.array(reading.q_m, dtype=np.float64)  # the robot may use its arrays again
        torque = None if reading.torque is None else np.array(reading.torque, dtype=np.float64)
        taken = Reading(min(reading.time, now), q_m, torque)
        doubt = self._doubt(now, reading.time, taken)
        if not doubt:
            self.state = taken
            self._agreeing += 1
        elif not self.ready:
            self.state, self._agreeing = None, 0
        return doubt

    def since_sent(self, now: float) -> float:
        """Return the time since the last command by the robot's clock [s]; nan before the first."""
        return now - self._sent

    def checked(self, dt: float, wanted: Array) -> Array:
        """Return the command nearest to the wanted one within all limits `(joints,)` [rad], `dt` [s] after the last.

        Where the wanted value is not finite, the command stays. Where commands failed for so long that none keeps rate
        and torque, it keeps the torque.
        """
        if self.state is None:
            raise RuntimeError("no command before an accepted reading")
        q_m, limits = self.state.q_m, self.limits
        before, step = self._before(q_m), self._step(dt)
        near = np.clip(np.where(np.isfinite(wanted), wanted, before), before - step, before + step)
        pressing = np.clip(near, q_m - self._reach, q_m + self._reach)
        return np.asarray(np.clip(pressing, limits.lower, limits.upper))

    def sent(self, now: float, command: Array) -> None:
        """Record a command that the robot took, at `now` of its clock [s]; do not call it for one that failed."""
        self.command, self._sent, self.sent_at = command, now, self.clock()

    def _step(self, dt: float) -> float:
        """Return the largest allowed change from the last command [rad]."""
        return self.limits.rate * min(dt, self.rules.lateness) if dt > 0 else 0.0

    def _before(self, q_m: Array) -> Array:
        """Return the last command; before the first one, `q_m` within the limits, where the fingers are."""
        return np.clip(q_m, self.limits.lower, self.limits.upper) if self.command is None else self.command

    def _doubt(self, now: float, stamp: float, reading: Reading) -> str:
        limits, rules, q_m, names = self.limits, self.rules, reading.q_m, self.names
        if not abs(now - stamp) <= rules.silence:
            return f"time stamp {stamp:.3f} s, the clock says {now:.3f} s"
        for what, values in (("angles", q_m), ("torques", reading.torque)):
            if values is not None and values.shape != limits.lower.shape:
                return f"{what} of shape {values.shape} for {len(names)} joints"
        wrong = ~(np.maximum(limits.lower - q_m, q_m - limits.upper) <= rules.margin)  # so no number is wrong too
        if wrong.any():
            at = int(np.argmax(wrong))
            return f"{names[at]} at {q_m[at]:.4g} rad, range {limits.lower[at]:.2f} to {limits.upper[at]:.2f} rad"
        return self._jump(reading) or self._without_room(self.since_sent(now), q_m)

    def _jump(self, reading: Reading) -> str:
        if self.state is None:
            return ""
        since, moved = reading.time - self.state.time, np.abs(reading.q_m - self.state.q_m)
        at = int(np.argmax(moved))
        if moved[at] <= self.rules.speed * since + ROUNDING:
            return ""
        allowed = f"{self.rules.speed:g} rad/s allowed"
        return f"{self.names[at]} moved by {moved[at]:.4f} rad in {1e3 * since:.1f} ms, {allowed}"

    def _without_room(self, dt: float, q_m: Array) -> str:
        limits, before, step = self.limits, self._before(q_m), self._step(dt)
        low = np.maximum(np.maximum(limits.lower, q_m - self._reach), before - step)
        high = np.minimum(np.minimum(limits.upper, q_m + self._reach), before + step)
        at = int(np.argmax(low - high))
        if low[at] <= high[at]:
            return ""
        return f"{self.names[at]} at {q_m[at]:.4g} rad, where no command keeps all limits"


REPEATS = 100  # commands at the goal that the robot takes before it is let alone, so that a lost message does no harm
LOOKING = 0.2  # how long new measurements are awaited after a gap [s]
PERIOD = 0.001  # shortest time between two commands [s]


class StopError(RuntimeError):
    """The fingers may still press: the robot did not take the commands that let go."""


class Phase(StrEnum):
    """Phase of a stop."""

    LOOKING = "looking"  # commands ceased for so long that the fingers may be elsewhere; nothing is sent
    RETURNING = "returning"  # the commands go to the goal
    RESTING = "resting"  # the last command asks for no torque; it is repeated
    OVER = "over"


class Stop:
    """Stop sequence: the last commands, by this computer's clock, in steps bounded whatever the robot's clock says.

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
        """Record that the robot took the last command."""
        assert self._offered is not None
        self._guard.sent(np.nan, self._offered)
        self.phase = Phase.RESTING if self.torque <= self._guard.rules.tolerance else Phase.RETURNING
        self._repeats = self._repeats + 1 if self.phase is Phase.RESTING else 0
        if self._repeats >= REPEATS:
            self._end()

    def look(self, now: float, reading: Reading | None) -> None:
        """Take a measurement while looking for a new goal, set once as many agree as at the beginning of a run."""
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
    """Run a stop to its end, whatever the robot's methods raise; `alive` is called at each step.

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
