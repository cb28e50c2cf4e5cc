"""Every command is finite, within limits of position, rate and torque, measured against the last accepted state.

SEQUENCES=10000 runs more of them than the default.
"""

import contextlib
import os
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_cube.deployment.command_guard import StopError
from tactile_cube.deployment.control_loop import ControlLoop, Homing
from tactile_cube.deployment.robot import JointLimits, StopRules
from tests.deployment.following_robot import FollowingRobot, Spoil, change, clock, drive, raising

sequences = settings(
    derandomize=True, max_examples=int(os.environ.get("SEQUENCES", "200")), deadline=None, database=None
)
HAND: Any = SimpleNamespace(joint_names=("a", "b"), start_angles=np.array([0.1, 0.3]))
LOWER, UPPER = np.array([-0.5, -0.3]), np.array([0.5, 1.5])
TICKS = 400
ERRORS = (ValueError("x"), OSError("x"), KeyboardInterrupt(), SystemExit(1))

anything = st.one_of(st.floats(), st.floats(-0.1, 0.1), st.sampled_from([np.nan, 1e308, 100.0, -3600.0, 57.3]))
errors = st.sampled_from(ERRORS)
places = st.sampled_from(["in_wait", "in_read", "in_send"])
joints = st.sampled_from([np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.ones(2)])


def pushed(angle: float) -> Spoil:
    """Move the joints by an angle, as somebody's hand does."""

    def spoil(robot: FollowingRobot) -> None:
        robot.q = robot.q + angle

    return spoil


def lost(robot: FollowingRobot) -> None:
    """Lose the reading."""
    robot.reading = None


readings = st.one_of(
    st.builds(lambda value, joint: change(q_m=lambda q: q + value * joint), anything, joints),
    st.builds(lambda value: change(q_m=np.array([value, 0.0])), anything),
    st.builds(lambda size: change(q_m=np.zeros(size)), st.integers(0, 4)),
    st.builds(lambda value: change(time=value), anything),
    st.builds(lambda value: change(time=lambda time: time + value), anything),
    st.builds(pushed, st.floats(-0.5, 0.5)),
    st.just(lost),
)
clocks = st.one_of(
    st.builds(lambda value: clock(lambda now: now + value), anything),
    st.builds(lambda value: clock(lambda now: value), anything),
    st.builds(lambda late: clock(lambda now: now + late), st.floats(-1e-3, 0.02)),
)
mishaps = st.one_of(
    readings.map(lambda spoil: ("in_read", spoil)),
    readings.map(lambda spoil: ("in_read", spoil)),
    clocks.map(lambda spoil: ("in_wait", spoil)),
    st.tuples(places, errors.map(raising)),
)
events = st.lists(st.tuples(st.integers(0, 60), mishaps, st.integers(1, 8)), max_size=8)
answers = st.one_of(
    st.builds(lambda value, joint: value * joint, anything, joints),
    st.builds(lambda low, high: np.array([low, high]), st.floats(-1.0, 2.0), st.floats(-1.0, 2.0)),
    st.builds(lambda low, high: np.array([low, high]), st.floats(-1.0, 2.0), st.floats(-1.0, 2.0)),
    st.builds(np.zeros, st.integers(0, 4)),
    errors,
)
positive = st.floats(1e-3, 100.0)
limits = st.builds(
    lambda rate, torque, kp: JointLimits(LOWER, UPPER, rate, torque, np.array(kp), np.full(2, 0.2)),
    st.floats(-2, 2).map(lambda power: 10.0**power),
    st.floats(-2, 1).map(lambda power: 10.0**power),
    st.tuples(st.floats(1e-3, 50.0), st.just(0.0) | st.floats(1e-3, 50.0)),
)
rules = st.builds(StopRules, positive, positive, positive, positive, positive)
usual = st.just(StopRules())


@dataclass
class Answers:
    """Gives one answer after the other, raises those that are errors, and writes into what it is given."""

    rows: list[Any]
    row: int = 0

    def reset(self) -> None:
        self.row = 0

    def step(self, q_m: np.ndarray, q_f: np.ndarray) -> np.ndarray:
        answer = self.rows[min(self.row, len(self.rows) - 1)]
        self.row += 1
        q_m[:], q_f[:] = np.nan, np.inf
        if isinstance(answer, BaseException):
            raise answer
        return np.asarray(answer)


class TooLongError(Exception):
    """The run goes on for longer than the test."""


@sequences
@given(
    events=events,
    answers=st.lists(answers, min_size=1, max_size=6),
    limits=limits,
    rules=st.one_of(usual, rules),
    start=st.one_of(st.just(HAND.start_angles), st.tuples(st.floats(-1.0, 2.0), st.floats(-1.0, 2.0)).map(np.array)),
    follow=st.floats(0.0, 1.0),
    homing=st.builds(Homing, st.floats(1.0, 20.0), st.floats(0.05, 2.0), st.floats(1e-3, 0.02), st.floats(0.01, 0.2)),
    time_constant=st.floats(0.0, 0.3),
    seconds=st.floats(0.01, 0.5),
    opened=st.none() | st.sampled_from([[0.0, 0.2], [0.6, 1.6]]).map(np.array),
)
def test_every_command_is_safe_whatever_is_read_answered_raised_and_set(
    events: list[tuple[int, tuple[str, Spoil], int]],
    answers: list[Any],
    limits: JointLimits,
    rules: StopRules,
    start: np.ndarray,
    follow: float,
    homing: Homing,
    time_constant: float,
    seconds: float,
    opened: np.ndarray | None,
) -> None:
    robot, tick = FollowingRobot(start, follow=follow), 1
    for gap, (where, spoil), times in events:
        tick += gap
        for _ in range(times):
            getattr(robot, where)[tick].append(spoil)
            tick += 1
    robot.in_wait[TICKS].append(raising(TooLongError()))
    robot.loop = ControlLoop(Answers(answers), time_constant, limits, rules, homing, seconds, HAND, opened, robot.clock)
    with np.errstate(all="ignore"), contextlib.suppress(TooLongError, StopError, *map(type, ERRORS)):
        drive(robot, limits, rules)
    assert robot.broken == []
