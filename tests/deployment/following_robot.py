"""A robot whose joints follow what it is sent while things go wrong, and what must hold of every command to it."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactile_cube.deployment.control_loop import ControlLoop, Mode
from tactile_cube.deployment.limits import JointLimits, StopRules
from tactile_cube.deployment.robot import Reading

TICK = 1e-3  # [s]
SMALL = 1e-9
Spoil = Callable[["FollowingRobot"], None]
"""Changes the robot's `now`, `reading` or `q`, or raises."""


@dataclass(frozen=True)
class Sent:
    """A command, when it was sent, and what the joints were and were believed to be."""

    time: float
    q_d: np.ndarray
    q: np.ndarray
    accepted: Reading
    mode: Mode


class FollowingRobot:
    """Joints that go a share of the way to the command each tick.

    What stands for a tick in `in_wait`, `in_read` and `in_send` spoils that call.
    """

    def __init__(self, start: np.ndarray, spoil: dict[int, list[Spoil]] | None = None, follow: float = 1.0) -> None:
        self.q, self.follow = np.array(start, dtype=float), follow
        self.in_wait: dict[int, list[Spoil]] = defaultdict(list)
        self.in_read = defaultdict(list, spoil or {})
        self.in_send: dict[int, list[Spoil]] = defaultdict(list)  # once: the hold may come in the same tick
        self.now, self.latest, self.ticks, self.closed = 0.0, 0.0, 0, False
        self.reading: Reading | None = None
        self.given: list[Reading] = []
        self.sent: list[Sent] = []
        self.released_at = 0.0
        self.tried = Mode.STOPPED
        self.confirms = True
        self.loop: ControlLoop

    def wait(self) -> float:
        self.ticks += 1
        self.now = self.latest + TICK
        try:
            for spoil in self.in_wait[self.ticks]:
                spoil(self)
        finally:
            if np.isfinite(self.now):
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
        self.sent.append(Sent(self.latest, q_d.copy(), self.q.copy(), self.loop.accepted, self.loop.mode))
        self.q += self.follow * (q_d - self.q)
        q_d[:] = np.nan  # it is the robot's now

    def wait_for_object(self) -> bool:
        return self.confirms

    def release(self) -> None:
        self.released_at = self.now

    def close(self) -> None:
        self.closed = True


def assert_every_command_is_safe(robot: FollowingRobot, limits: JointLimits, rules: StopRules) -> None:
    """Every command is finite, within range, rate and torque, and measured against the last accepted state."""
    if not robot.sent:
        return
    with np.errstate(over="ignore"):  # of a clock that says 1e308
        _assert_safe(robot, limits, rules)


def _assert_safe(robot: FollowingRobot, limits: JointLimits, rules: StopRules) -> None:
    q_d, accepted = (np.array(rows) for rows in zip(*((one.q_d, one.accepted.q_m) for one in robot.sent), strict=True))
    sent, stamped = np.array([(one.time, one.accepted.time) for one in robot.sent]).T
    assert np.isfinite(q_d).all()
    assert ((limits.lower <= q_d) & (q_d <= limits.upper)).all()
    assert (limits.kp * np.abs(q_d - accepted) <= limits.torque * (1 + SMALL) + SMALL).all()
    assert (np.abs(np.diff(q_d, axis=0)) <= (limits.rate * (1 + SMALL) * np.diff(sent) + SMALL)[:, None]).all()
    np.testing.assert_array_equal(q_d[0], np.clip(accepted[0], limits.lower, limits.upper))
    assert {one.tobytes() for one in accepted} <= {one.q_m.tobytes() for one in robot.given}
    assert (np.maximum(limits.lower - accepted, accepted - limits.upper) <= rules.margin).all()
    assert (np.abs(np.diff(accepted, axis=0)) <= (rules.speed * (1 + SMALL) * np.diff(stamped) + SMALL)[:, None]).all()
    assert ((stamped <= sent) & (np.diff(stamped, prepend=stamped[0]) >= 0)).all()


def assert_left_in_order(robot: FollowingRobot) -> None:
    """The robot is closed, and what was sent last, or tried to be, is the hold."""
    assert robot.closed
    assert robot.loop.mode is robot.tried is Mode.STOPPED


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
    """Raise an error."""

    def spoil(robot: FollowingRobot) -> None:
        raise error

    return spoil
