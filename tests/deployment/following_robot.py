"""A robot whose joints follow what it is sent while things go wrong, and what must hold of every command to it."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np

from tactile_cube.deployment.command_guard import StopError
from tactile_cube.deployment.control_loop import ControlLoop, Mode
from tactile_cube.deployment.robot import JointLimits, Reading, StopRules
from tactile_cube.deployment.run_loop import LoopLog, LoopRun, run_loop

TICK = 1e-3  # [s]
SMALL = 1e-9
Spoil = Callable[["FollowingRobot"], None]
"""Changes the robot's `now`, `reading` or `q`, or raises."""


@dataclass(frozen=True)
class Sent:
    """A command, when it was sent by the robot's clock and ours, and where the joints were and were believed to be."""

    time: float
    elapsed: float
    q_d: np.ndarray
    q: np.ndarray
    accepted: Reading
    mode: Mode


class FollowingRobot:
    """Joints that go a share of the way to the command each tick.

    What stands for a tick in `in_wait`, `in_read` and `in_send` spoils that call. `elapsed` is this computer's clock,
    which a tick takes on by `period`.
    """

    def __init__(self, start: np.ndarray, spoil: dict[int, list[Spoil]] | None = None, follow: float = 1.0) -> None:
        self.q, self.follow = np.array(start, dtype=float), follow
        self.in_wait: dict[int, list[Spoil]] = defaultdict(list)
        self.in_read = defaultdict(list, spoil or {})
        self.in_send: dict[int, list[Spoil]] = defaultdict(list)  # once: the hold may come in the same tick
        self.now, self.latest, self.ticks, self.closed = 0.0, 0.0, 0, False
        self.elapsed, self.period = 0.0, TICK
        self.reading: Reading | None = None
        self.given: list[Reading] = []
        self.sent: list[Sent] = []
        self.released_at = 0.0
        self.tried = Mode.STOPPED
        self.confirms = True
        self.broken: list[str] = []
        self.loop: ControlLoop

    def clock(self) -> float:
        return self.elapsed

    def sleep(self, seconds: float) -> None:
        self.elapsed += seconds
        self.latest += seconds

    def wait(self) -> float:
        self.ticks += 1
        self.elapsed += self.period
        self.now = self.latest + TICK
        try:
            for spoil in self.in_wait[self.ticks]:
                spoil(self)
        finally:
            if self.now is not None and np.isfinite(self.now):
                self.latest = max(self.latest, self.now)
        return self.now

    def read(self) -> Reading | None:
        self.reading = Reading(self.now, self.q.copy())
        for spoil in self.in_read[self.ticks]:
            spoil(self)
        if self.reading is not None:
            self.given.append(Reading(self.reading.time, np.array(self.reading.q_m, dtype=float)))
        return self.reading

    def send(self, q_d: np.ndarray) -> None:
        self.tried = self.loop.mode
        for spoil in self.in_send.pop(self.ticks, []):
            spoil(self)
        assert self.loop.accepted is not None
        self.sent.append(Sent(self.latest, self.elapsed, q_d.copy(), self.q.copy(), self.loop.accepted, self.loop.mode))
        self.q += self.follow * (q_d - self.q)
        q_d[:] = np.nan  # it is the robot's now

    def wait_for_object(self) -> bool:
        return self.confirms

    def release(self) -> None:
        self.released_at = self.now

    def close(self) -> None:
        self.closed = True


def drive(
    robot: FollowingRobot,
    limits: JointLimits,
    rules: StopRules,
    say: Callable[[str], None] = lambda line: None,
    log: LoopLog | None = None,
) -> LoopRun:
    """Run the robot's loop; however that ends, every command is safe and the last one presses on nothing."""
    presses = False
    try:
        with mock.patch("tactile_cube.deployment.command_guard.time", SimpleNamespace(sleep=robot.sleep)):
            return run_loop(robot.loop, robot, say, log)
    except StopError:
        presses = True
        raise
    finally:
        assert robot.closed
        assert robot.loop.mode is Mode.STOPPED
        if robot.sent:
            with np.errstate(over="ignore"):  # of a clock that says 1e308
                robot.broken = broken_rules(robot, limits, rules)
            assert not robot.broken
            assert robot.tried is Mode.STOPPED
            assert presses or torque(robot.sent[-1], limits) <= rules.tolerance


def torque(sent: Sent, limits: JointLimits) -> float:
    """Spring torque of a command against the angles that were believed, within the range [N m]."""
    return float(np.max(limits.kp * np.abs(sent.q_d - np.clip(sent.accepted.q_m, limits.lower, limits.upper))))


def broken_rules(robot: FollowingRobot, limits: JointLimits, rules: StopRules) -> list[str]:
    """What a safe command keeps and one of these did not."""
    q_d, accepted = (np.array(rows) for rows in zip(*((one.q_d, one.accepted.q_m) for one in robot.sent), strict=True))
    sent, ours, stamped = np.array([(one.time, one.elapsed, one.accepted.time) for one in robot.sent]).T
    stopped = np.array([one.mode is Mode.STOPPED for one in robot.sent])
    since = np.where(stopped[1:], np.diff(ours), np.diff(sent))[:, None]
    weak = limits.kp * np.abs(q_d - accepted)[1:] < limits.torque * (1 - SMALL)  # else the torque may ask for more
    since = np.where(weak & stopped[1:, None], np.minimum(since, rules.lateness), since)
    run, moved = ~stopped[1:], np.abs(np.diff(accepted, axis=0))
    kept = {
        "finite": np.isfinite(q_d),
        "range": (limits.lower <= q_d) & (q_d <= limits.upper),
        "torque": limits.kp * np.abs(q_d - accepted) <= limits.torque * (1 + SMALL) + SMALL,
        "rate": np.abs(np.diff(q_d, axis=0)) <= limits.rate * (1 + SMALL) * since + SMALL,
        "begins where the joints are": q_d[0] == np.clip(accepted[0], limits.lower, limits.upper),
        "believes what was read": {one.tobytes() for one in accepted} <= {one.q_m.tobytes() for one in robot.given},
        "believes the range": np.maximum(limits.lower - accepted, accepted - limits.upper) <= rules.margin,
        "believes the speed": moved[run] <= (rules.speed * (1 + SMALL) * np.diff(stamped)[run] + SMALL)[:, None],
        "time": (stamped <= sent) & (np.diff(stamped, prepend=stamped[0]) >= 0),
    }
    return [rule for rule, rows in kept.items() if not np.all(rows)]


def change(**fields: Any) -> Spoil:
    """Change fields of the reading: values, or functions of the field as it is."""

    def spoil(robot: FollowingRobot) -> None:
        if robot.reading is None:
            return
        new = {key: value(getattr(robot.reading, key)) if callable(value) else value for key, value in fields.items()}
        robot.reading = Reading(**({"time": robot.reading.time, "q_m": robot.reading.q_m} | new))

    return spoil


def clock(change: Callable[[float], float]) -> Spoil:
    """Change what the clock says."""

    def spoil(robot: FollowingRobot) -> None:
        robot.now = change(robot.now)

    return spoil


def raising(error: BaseException) -> Spoil:
    """Raise an error, each time a new one: a kept one would keep every traceback."""

    def spoil(robot: FollowingRobot) -> None:
        raise type(error)(*error.args)

    return spoil
