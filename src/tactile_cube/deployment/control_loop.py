"""Control loop of a robot: opens the fingers, waits for the object, runs the policy and stops by itself."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from enum import StrEnum
from math import inf, isfinite

import numpy as np

from tactile_cube.deployment.command_guard import CommandGuard, Stop
from tactile_cube.deployment.controller import POLICY_RATE, PlayedTargets, PolicyController
from tactile_cube.deployment.robot import Array, JointLimits, Reading, StopRules, Watchdog, require_positive
from tactile_cube.deployment.training_setting import TrainingSetting
from tactile_cube.drivetrain.laws import low_pass
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.hand.kinematics import grasp_angles

ROUNDING = 1e-9  # [s] of clocks that add up ticks


class Mode(StrEnum):
    """Mode of the loop."""

    WAITING = "waiting"  # too few measurements agree yet; nothing is sent
    HOMING = "homing"  # the fingers open for the object, or go to the start angles where none is awaited
    WAIT_FOR_OBJECT = "wait for object"  # until somebody confirms that it is there
    CLOSING = "closing"  # the fingers go to the start angles around the object
    RUNNING = "running"  # the policy decides
    STOPPED = "stopped"  # `stop` gives the last commands; only a new loop starts again


@dataclass(frozen=True)
class Homing:
    """How the fingers open, wait for the object and close: `homing` of conf/deploy.yaml [rad/s, rad, s, s, m]."""

    speed: float = 0.5
    tolerance: float = 0.05
    settle: float = 0.5
    timeout: float = 10.0
    clearance: float = 0.015

    def __post_init__(self) -> None:
        require_positive({f"homing.{name}": value for name, value in asdict(self).items()})


def open_angles(setting: TrainingSetting, clearance: float) -> Array:
    """Return the angles `(joints,)` [rad] with the fingertips `clearance` [m] off the object's faces."""
    known, upright = setting.constants, np.array([0.0, 0.0, 0.0, 1.0])
    size = np.asarray(known.cube_size)
    return grasp_angles(setting.hand, size, np.zeros(3), upright, clearance, known.object_shape)


class Move:
    """A straight line from `start` to `goal`, both `(joints,)` [rad], judged by what is measured."""

    def __init__(self, homing: Homing, now: float, start: Array, goal: Array) -> None:
        self._homing, self._began, self._start, self._goal = homing, now, start, goal
        self._needs = float(np.max(np.abs(goal - start))) / homing.speed
        self._in_place = now

    def target(self, now: float) -> Array:
        """Return where the fingers should be `(joints,)` [rad]."""
        return self._start + self._share(now) * (self._goal - self._start)

    def arrived(self, now: float, q_m: Array) -> bool:
        """Return whether the fingers have stayed at the goal for long enough."""
        if self._share(now) < 1.0 or self._away(q_m) > self._homing.tolerance:
            self._in_place = now
        return now - self._in_place >= self._homing.settle

    def failure(self, now: float, q_m: Array) -> str:
        """Return why the move has failed; "" if it has not."""
        took = now - self._began
        if took <= self._needs + self._homing.timeout:
            return ""
        return f"still {self._away(q_m):.2f} rad from the goal after {took:.0f} s"

    def _share(self, now: float) -> float:
        return 1.0 if self._needs == 0.0 else min(1.0, (now - self._began) / self._needs)

    def _away(self, q_m: Array) -> float:
        return float(np.max(np.abs(q_m - self._goal)))


class ControlLoop:
    """Control loop: one call of `tick` is one period, at 1 kHz on the robot; it never waits.

    What it sends passes `CommandGuard` last. Whoever drives it says by `sent` that the robot took a command, and
    drives what `stop` returns once the loop is stopped; see `let_go`.

    Args:
        decides: gives q_n at 10 Hz.
        time_constant: T_s of the target filter [s].
        limits: of every command.
        rules: when to stop.
        homing: how to begin.
        seconds: how long the policy decides; then the loop stops.
        hand: whose start angles these are.
        opened: angles at which the fingers wait for the object `(joints,)` [rad]; None: there is none to wait for.
        clock: monotonic, of this computer, whatever the robot's says [s].

    Attributes:
        reason: why it stopped; "" before.
        doubted: number of rejected measurements; `doubt` says why the last of them was rejected.
        q_n: desired angles of the policy `(joints,)` [rad]; q_f are the filtered ones.

    Raises:
        InputError: a time or a filter time without a meaning.
    """

    def __init__(
        self,
        decides: PolicyController | PlayedTargets,
        time_constant: float,
        limits: JointLimits,
        rules: StopRules,
        homing: Homing,
        seconds: float,
        hand: Hand = DLR_HAND2,
        opened: Array | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        require_positive({"seconds": seconds})
        if not (isinstance(time_constant, (int, float)) and 0 <= time_constant < inf):
            raise InputError(f"filter_time is {time_constant}; give a finite number of 0 s or more")
        self._decides, self._limits, self._homing, self._seconds = decides, limits, homing, seconds
        self._home, self._opened = np.array(hand.start_angles, dtype=np.float64), opened
        self._time_constant, self._filtered = time_constant, self._home.copy()
        self._guard = CommandGuard(limits, rules, hand.joint_names, clock)
        self._watchdog = Watchdog(rules, hand.joint_names)
        self.mode, self.reason, self.time = Mode.WAITING, "", -inf
        self.doubted, self.doubt = 0, ""
        self.q_n = self.q_f = self._home
        self._since = self._asked = 0.0
        self._offered: Array | None = None

    @property
    def doing(self) -> str:
        """Present mode, in words."""
        start = "the fingers go to the start angles"
        policy = "the policy decides; let go of the object"
        return {
            Mode.HOMING: start if self._opened is None else "the fingers open",
            Mode.WAIT_FOR_OBJECT: "put it between the open fingers",
            Mode.CLOSING: start,
            Mode.RUNNING: policy if isinstance(self._decides, PolicyController) else "an excitation, no policy",
        }.get(self.mode, self.reason)

    @property
    def accepted(self) -> Reading | None:
        """The last measurement that was accepted."""
        return self._guard.state

    def warm_up(self) -> None:
        """Compile and load all that a tick needs, so that no tick is late; nothing is sent."""
        self._decides.reset()
        self._decides.step(self._home.copy(), self._home.copy())
        low_pass(0.0, 0.0, self._time_constant, 1.0)
        self._decides.reset()

    def tick(self, now: float, reading: Reading | None = None) -> Array | None:
        """Return the desired angles q_d `(joints,)` [rad] to send, or None while nothing may be sent.

        `now` [s] is on a monotonic clock; `reading` is what has been measured since the tick before.
        """
        dt = now - self.time if now > self.time and isfinite(now) else 0.0
        if dt == 0.0:
            self.stop(f"the clock went from {self.time:g} s to {now:g} s")
        else:
            self.time = now
        doubt = "" if reading is None else self._guard.accept(now, reading)
        if doubt:
            self.doubted, self.doubt = self.doubted + 1, doubt
        last = self.accepted
        if last is None or (self.mode is Mode.WAITING and not self._guard.ready):
            return None
        if self.mode is Mode.WAITING:
            goal = self._home if self._opened is None else self._opened
            self._move, self.mode = Move(self._homing, now, last.q_m, goal), Mode.HOMING
        elif why := self._watchdog.judge(dt, now - last.time, self._guard.saturated):
            self.stop(why)
        if not doubt:
            self._go_on(now, dt, last.q_m.copy())
        if self.mode is Mode.STOPPED:
            return None
        self._offered = self._guard.checked(self._guard.since_sent(now), self.q_f)
        return self._offered.copy()

    def sent(self) -> None:
        """Record that the robot took the command of the last tick."""
        if self._offered is not None:
            self._guard.sent(self.time, self._offered)

    def confirm_object(self) -> None:
        """Close the fingers around the object, which somebody has put between them."""
        if self.mode is Mode.WAIT_FOR_OBJECT:
            self._move, self.mode = Move(self._homing, self.time, self.q_f, self._home), Mode.CLOSING

    def stop(self, reason: str) -> Stop:
        """Stop the policy; return the stop sequence, which gives the commands from now on."""
        if self.mode is not Mode.STOPPED:
            doubts = f"; {self.doubted} measurement(s) not believed, the last: {self.doubt}" if self.doubted else ""
            self.mode, self.reason = Mode.STOPPED, reason + doubts
            self._stopping = Stop(self._guard)
        return self._stopping

    def _go_on(self, now: float, dt: float, q_m: Array) -> None:
        if self.mode in (Mode.HOMING, Mode.CLOSING):
            self.q_f = self._move.target(now)
            failure = self._move.failure(now, q_m)
            if self._move.arrived(now, q_m):
                self._arrive(now, q_m)
            elif failure:
                self.stop(f"{self.mode}: {failure}")
        if self.mode is Mode.RUNNING:
            self._run_on(now, dt, q_m)

    def _arrive(self, now: float, q_m: Array) -> None:
        if self.mode is Mode.HOMING and self._opened is not None:
            self.mode = Mode.WAIT_FOR_OBJECT
            return
        self.mode, self._since, self._asked = Mode.RUNNING, now, now
        self._decides.reset()
        self._filtered = q_m.copy()

    def _run_on(self, now: float, dt: float, q_m: Array) -> None:
        if now - self._since > self._seconds - ROUNDING:
            self.stop("time is over")
        elif now < self._asked - ROUNDING or self._ask(q_m):
            for joint, goal in enumerate(self.q_n):
                self._filtered[joint] = low_pass(self._filtered[joint], goal, self._time_constant, dt)
            self.q_f = self._filtered.copy()

    def _ask(self, q_m: Array) -> bool:
        """Ask for the next q_n; False, and stopped, if it is none."""
        q_n = np.asarray(self._decides.step(q_m, self._filtered.copy()), dtype=np.float64)
        self._asked += 1.0 / POLICY_RATE
        if q_n.shape != self._home.shape or not np.isfinite(q_n).all():
            self.stop(f"desired angles that are no numbers of {len(self._home)} joints: {q_n}")
            return False
        self.q_n = np.clip(q_n, self._limits.lower, self._limits.upper)
        return True
