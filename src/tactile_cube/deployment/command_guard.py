"""The last check of every command: finite, and within the limits around the last accepted angles."""

from __future__ import annotations

from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from tactile_cube.deployment.limits import JointLimits, StopRules
from tactile_cube.deployment.robot import Reading

Array = NDArray[np.float64]
AGREEING = 5
"""Readings in a row that must agree before the first command."""
ROUNDING = 1e-9  # [rad] of angles that add up ticks


class CommandGuard:
    """Takes readings over only if a joint can have moved so, and lets commands out only within the limits.

    Every command is finite, within the range, at most rate * dt away from the one before, and at most torque / K_P
    away from the last accepted angles. A reading around which no such command exists is not accepted.

    Attributes:
        state: last accepted reading; before the first command the newest of those that agree.
        command: last command `(joints,)` [rad].
    """

    def __init__(self, limits: JointLimits, rules: StopRules, names: tuple[str, ...]) -> None:
        self._limits, self._rules, self._names = limits, rules, names
        self._reach = limits.reach
        self.state: Reading | None = None
        self.command: Array | None = None
        self._sent, self._newest, self._agreeing = nan, -inf, 0

    @property
    def ready(self) -> bool:
        """Whether so many readings agree that commands may begin."""
        return self._agreeing >= AGREEING

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Joints whose command demands all the torque there is `(joints,)`."""
        if self.state is None or self.command is None:
            return np.zeros(len(self._names), dtype=bool)
        return np.asarray(np.abs(self.command - self.state.q_m) > 0.99 * self._reach)

    def accept(self, now: float, reading: Reading) -> str:
        """Take a reading over as the state; return "" or why it is not believed."""
        doubt = self._doubt(now, reading)
        if not doubt:
            torque = None if reading.torque is None else np.array(reading.torque)  # the robot may use its arrays again
            self.state = Reading(min(reading.time, now), np.array(reading.q_m, dtype=np.float64), torque)
            self._agreeing += 1
        elif self.command is None:
            self.state, self._agreeing = None, 0
        return doubt

    def checked(self, now: float, wanted: Array) -> Array:
        """Return the command to send `(joints,)` [rad]: the nearest to the wanted one that keeps every limit.

        Where what is wanted is no number, the command stays.
        """
        if self.state is None:
            raise RuntimeError("no command before an accepted reading")
        low, high = self._room(now, self.state.q_m)
        self.command = np.clip(np.where(np.isfinite(wanted), wanted, self._before(self.state.q_m)), low, high)
        self._sent = now if now > self._newest else nan  # a clock that goes back gives no room until it has caught up
        self._newest = max(self._newest, now)
        return self.command.copy()

    def _room(self, now: float, q_m: Array) -> tuple[Array, Array]:
        """Lowest and highest command that every limit allows at measured angles; crossed where there is none."""
        limits, before, dt = self._limits, self._before(q_m), now - self._sent
        step = limits.rate * dt if 0 < dt <= self._rules.lateness else 0.0
        low = np.maximum(np.maximum(limits.lower, q_m - self._reach), before - step)
        high = np.minimum(np.minimum(limits.upper, q_m + self._reach), before + step)
        return low, high

    def _before(self, q_m: Array) -> Array:
        """The last command; at first the fingers stay where they are."""
        return np.clip(q_m, self._limits.lower, self._limits.upper) if self.command is None else self.command

    def _doubt(self, now: float, reading: Reading) -> str:
        limits, rules, q_m = self._limits, self._rules, np.asarray(reading.q_m, dtype=np.float64)
        if not abs(now - reading.time) <= rules.silence:
            return f"time stamp {reading.time:.3f} s, the clock says {now:.3f} s"
        if q_m.shape != limits.lower.shape:
            return f"angles of shape {q_m.shape} for {len(self._names)} joints"
        wrong = ~(np.maximum(limits.lower - q_m, q_m - limits.upper) <= rules.margin)  # so no number is wrong too
        if wrong.any():
            at = int(np.argmax(wrong))
            return f"{self._names[at]} at {q_m[at]:.4g} rad, range {limits.lower[at]:.2f} to {limits.upper[at]:.2f} rad"
        return self._jump(now, reading.time, q_m) or self._without_room(now, q_m)

    def _jump(self, now: float, time: float, q_m: Array) -> str:
        """Say which joint has moved further than it can since the last accepted reading."""
        if self.state is None:
            return ""
        since, moved = min(time, now) - self.state.time, np.abs(q_m - self.state.q_m)
        at = int(np.argmax(moved))
        if moved[at] <= self._rules.speed * since + ROUNDING:
            return ""
        allowed = f"{self._rules.speed:g} rad/s allowed"
        return f"{self._names[at]} moved by {moved[at]:.4f} rad in {1e3 * since:.1f} ms, {allowed}"

    def _without_room(self, now: float, q_m: Array) -> str:
        low, high = self._room(now, q_m)
        at = int(np.argmax(low - high))
        if low[at] <= high[at]:
            return ""
        return f"{self._names[at]} at {q_m[at]:.4g} rad, where no command keeps all limits"
