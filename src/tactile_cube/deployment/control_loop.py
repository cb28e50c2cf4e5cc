"""The robot's side in one place: a fast loop that homes the fingers, asks the policy at 10 Hz, and stops by itself."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tactile_cube.deployment.controller import POLICY_RATE, Controller, TargetFilter
from tactile_cube.deployment.limits import Limits
from tactile_cube.deployment.robot import Reading
from tactile_cube.deployment.stop_rules import StopRules, Watchdog
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand

Array = NDArray[np.float64]
ROUNDING = 1e-9  # [s] of clocks that add up ticks


class Mode(StrEnum):
    """What the loop is doing.

    - `waiting`: no measurement has come yet; nothing is sent.
    - `homing`: the fingers go to the start angles in a straight line.
    - `running`: the policy decides.
    - `stopped`: the fingers are held where they were; only a new loop starts again.
    """

    WAITING = "waiting"
    HOMING = "homing"
    RUNNING = "running"
    STOPPED = "stopped"


class Decides(Protocol):
    """Gives the desired joint angles of the next 0.1 s."""

    def reset(self) -> None:
        """Begin a run."""

    def step(self, q_m: Array, q_f: Array) -> Array:
        """Return q_n `(joints,)` [rad] for measured angles and filtered targets `(joints,)` [rad]."""


@dataclass(frozen=True)
class Homing:
    """How the fingers get to the start angles.

    Attributes:
        speed: of the joint that has the longest way [rad/s].
        tolerance: how close every joint must come [rad]: friction and weight leave 0.03 rad at this stiffness.
        settle: how long they then rest there [s].
        timeout: after which homing has failed [s].
    """

    speed: float = 0.5
    tolerance: float = 0.05
    settle: float = 0.5
    timeout: float = 10.0


class ControlLoop:
    """One call of `tick` is one period of the fast loop, at 1 kHz on the robot; it never waits.

    Args:
        decides: gives q_n at 10 Hz, the policy's `Controller` or anything else.
        time_constant: T_s of the target filter [s].
        limits: of every command.
        rules: when to stop.
        homing: how to begin.
        seconds: how long the policy decides; then the loop stops.
        hand: whose start angles and range these are.

    Attributes:
        mode: what it is doing.
        reason: why it stopped; "" before.
        q_n: desired angles of the policy `(joints,)` [rad].
        q_f: filtered ones `(joints,)` [rad].
        q_d: what was sent last `(joints,)` [rad].
    """

    def __init__(
        self,
        decides: Decides,
        time_constant: float,
        limits: Limits,
        rules: StopRules,
        homing: Homing,
        seconds: float,
        hand: Hand = DLR_HAND2,
    ) -> None:
        if not seconds > 0:
            raise InputError(f"seconds is {seconds}; give a time above 0 s")
        self._decides, self._limits, self._homing, self._seconds = decides, limits, homing, seconds
        self._filter = TargetFilter(time_constant, rate=1.0)
        self._home = np.asarray(hand.start_angles, dtype=np.float64)
        self._watchdog = Watchdog(rules, hand.lower, hand.upper, hand.joint_names)
        self.mode, self.reason = Mode.WAITING, ""
        self.q_n = self.q_f = self.q_d = self._home
        self._last: Reading | None = None
        self._before = self._since = self._in_place = self._asked = 0.0

    @property
    def decider(self) -> str:
        """Who gives q_n, in words."""
        return "the policy decides" if isinstance(self._decides, Controller) else "an excitation, no policy"

    def tick(self, now: float, reading: Reading | None) -> Array | None:
        """Return the desired angles q_d `(joints,)` [rad] to send, or None while nothing may be sent.

        Args:
            now: time of this tick [s].
            reading: what has been measured since the tick before; None: nothing.
        """
        self._last = reading or self._last
        if self._last is None:
            return None
        if self.mode is Mode.WAITING:
            self._begin_homing(now, self._last)
        dt, self._before = now - self._before, now
        if self.mode is not Mode.STOPPED:
            self._guard(now, dt, self._last)
        wanted = self._wanted(now, dt, self._last)
        last = self._last
        if self.mode is not Mode.STOPPED:
            self.q_d = self._limits.apply(self.q_d, wanted, last.q_m, last.dq, dt)
        return self.q_d

    def stop(self, reason: str) -> None:
        """Hold the fingers where they are."""
        self.mode, self.reason = Mode.STOPPED, reason
        if self._last is not None and np.isfinite(self._last.q_m).all():
            self.q_d = np.clip(self._last.q_m, self._limits.lower, self._limits.upper)

    def _guard(self, now: float, dt: float, last: Reading) -> None:
        wish = self._limits.kp * (self.q_d - last.q_m) - self._limits.kd * last.dq
        reason = self._watchdog.judge(now, dt, last, np.abs(wish) > 0.99 * self._limits.torque)
        if reason:
            self.stop(reason)

    def _wanted(self, now: float, dt: float, last: Reading) -> Array:
        if self.mode is Mode.HOMING:
            self._home_further(now, last)
        if self.mode is Mode.RUNNING:
            self._run_further(now, dt, last)
        return self.q_f

    def _begin_homing(self, now: float, first: Reading) -> None:
        self.mode, self._since, self._before = Mode.HOMING, now, now
        self.q_d = self.q_f = self._from = np.array(first.q_m)
        self._needs = float(np.max(np.abs(self._home - self._from))) / self._homing.speed

    def _home_further(self, now: float, last: Reading) -> None:
        share = 1.0 if self._needs == 0.0 else min(1.0, (now - self._since) / self._needs)
        self.q_f = self._from + share * (self._home - self._from)
        away = float(np.max(np.abs(last.q_m - self._home)))
        if share < 1.0 or away > self._homing.tolerance:
            self._in_place = now
        if now - self._in_place >= self._homing.settle:
            self._begin_running(now, last)
        elif now - self._since > self._needs + self._homing.timeout:
            self.stop(f"homing: still {away:.2f} rad from the start angles after {now - self._since:.0f} s")

    def _begin_running(self, now: float, last: Reading) -> None:
        self.mode, self._since, self._asked = Mode.RUNNING, now, now
        self._decides.reset()
        self._filter.filtered = np.array(last.q_m)

    def _run_further(self, now: float, dt: float, last: Reading) -> None:
        if now - self._since > self._seconds - ROUNDING:
            self.stop("time is over")
            return
        if now >= self._asked - ROUNDING:
            self.q_n = self._decides.step(last.q_m, self._filter.filtered)
            self._asked += 1.0 / POLICY_RATE
        self._filter.rate = 1.0 / dt if dt > 0 else np.inf
        self.q_f = np.array(self._filter.step(self.q_n))
