"""Every way out lets go: blocked fingers on which the policy presses, every clock, every error, every signal.

SEQUENCES=10000 runs more of them than the default.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_cube.deployment import run_loop
from tactile_cube.deployment.command_guard import REPEATS, StopError
from tactile_cube.deployment.control_loop import ControlLoop, Homing, Mode
from tactile_cube.deployment.controller import PlayedTargets
from tactile_cube.deployment.robot import JointLimits, Reading, StopRules
from tactile_cube.deployment.run_loop import LoopRun
from tactile_cube.deployment.simulated_hand import SimulatedHand
from tests.deployment.following_robot import TICK, FollowingRobot, Spoil, clock, drive, raising, torque
from tests.deployment.test_every_command import HAND, LOWER, UPPER, sequences

HOME = HAND.start_angles
RULES = StopRules()
LIMITS = JointLimits(LOWER, UPPER, 6.28, 1.0, np.full(2, 3.69), np.full(2, 0.25))
PRESSING = 0.92  # [N m]
AT = 250  # a tick at which the fingers press with all of it
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGUSR1", "SIGXCPU")


def run(robot: FollowingRobot, targets: np.ndarray | None = None, seconds: float = 0.5) -> LoopRun:
    """Fingers close at once; a policy presses."""
    wanted = HOME + PRESSING / LIMITS.kp if targets is None else targets
    robot.loop = ControlLoop(
        PlayedTargets(wanted[None]), 0.02, LIMITS, RULES, Homing(1.0, settle=0.05), seconds, HAND, clock=robot.clock
    )
    return drive(robot, LIMITS, RULES)


def killing(name: str) -> Spoil:
    return lambda robot: os.kill(os.getpid(), signal.Signals[name])


def every(spoil: Spoil) -> Callable[[FollowingRobot], None]:
    """A clock that goes on like this until the end."""

    def begin(robot: FollowingRobot) -> None:
        for tick in range(AT, AT + 6000):
            robot.in_wait[tick].append(spoil)

    return begin


def late(period: float) -> Callable[[FollowingRobot], None]:
    """Every tick comes late, by both clocks."""

    def slow(robot: FollowingRobot) -> None:
        robot.period, robot.now = period, robot.latest + period

    return every(slow)


def frozen(robot: FollowingRobot) -> None:
    robot.now = robot.latest


CLOCKS: dict[str, Callable[[FollowingRobot], None]] = {
    "sound": lambda robot: None,
    "frozen": every(frozen),
    "creeping": every(clock(lambda now: now - TICK + 1e-9)),
    "nan": every(clock(lambda now: np.nan)),
    "None": every(lambda robot: setattr(robot, "now", None)),
    "back by 1 s": every(clock(lambda now: now - 1.0)),
    "back by 1 h": every(clock(lambda now: now - 3600.0)),
    "an hour on": every(clock(lambda now: now + 3600.0)),
    "22 ms": late(0.022),
    "150 ms": late(0.15),
}
WAYS: dict[str, Callable[[FollowingRobot], None]] = {
    "time is over": lambda robot: None,
    "no measurement": lambda robot: robot.in_read.update({tick: [lost] for tick in range(AT, AT + 6000)}),
    **{
        f"{type(error).__name__} in {call}": lambda robot, call=call, error=error: getattr(robot, call)[AT].append(  # type: ignore[misc]
            raising(error)
        )
        for call in ("in_wait", "in_read", "in_send")
        for error in (OSError("gone"), KeyboardInterrupt(), SystemExit(1))
    },
    **{name: lambda robot, name=name: robot.in_read[AT].append(killing(name)) for name in SIGNALS},  # type: ignore[misc]
}


def lost(robot: FollowingRobot) -> None:
    robot.reading = None


@pytest.fixture(autouse=True)
def _silent_errors() -> Any:
    with np.errstate(all="ignore"):
        yield


@pytest.mark.timeout(3600)
@sequences
@given(
    clock=st.sampled_from(sorted(CLOCKS)),
    way=st.sampled_from(sorted(WAYS)),
    failed=st.lists(st.tuples(st.integers(0, 250), st.sampled_from(["in_send", "in_wait", "in_read"])), max_size=30),
    again=st.lists(st.tuples(st.integers(0, 300), st.sampled_from(SIGNALS[:5])), max_size=3),
)
def test_the_last_command_presses_on_nothing(clock, way, failed, again) -> None:
    robot = FollowingRobot(HOME, follow=0.0)
    CLOCKS[clock](robot)
    WAYS[way](robot)
    for gap, call in failed:
        getattr(robot, call)[AT + gap].append(raising(OSError("gone")))
    for gap, name in again:
        robot.in_wait[AT + gap].append(killing(name))
    with contextlib.suppress(OSError, KeyboardInterrupt, SystemExit, TypeError):
        run(robot)
    assert max(torque(one, LIMITS) for one in robot.sent) > 0.9 * PRESSING
    assert torque(robot.sent[-1], LIMITS) <= RULES.tolerance
    np.testing.assert_allclose(robot.sent[-1].q_d, robot.q, atol=RULES.tolerance / 3.69)


@pytest.mark.parametrize("failures", [1, 50, 100, 400])
def test_after_failed_sends_the_next_command_goes_one_bounded_step(failures: int) -> None:
    robot = FollowingRobot(HOME, follow=0.0)
    robot.in_read[AT].append(killing("SIGTERM"))
    for tick in range(AT + 1, AT + 1 + failures):
        robot.in_send[tick].append(raising(OSError("gone")))
    assert run(robot).reason == "interrupted by SIGTERM"
    steps = np.abs(np.diff([one.q_d for one in robot.sent], axis=0))
    assert steps.max() <= LIMITS.rate * RULES.lateness * (1 + 1e-9)
    assert sum(one.mode is Mode.STOPPED for one in robot.sent) > REPEATS


@pytest.mark.parametrize("failed", ["in_send", "in_wait"])
def test_a_link_that_stays_broken_is_said_after_a_stated_time(failed: str) -> None:
    robot = FollowingRobot(HOME, follow=0.0)
    for tick in range(AT, AT + 20_000):
        getattr(robot, failed)[tick].append(raising(OSError("gone")))
    with pytest.raises(OSError if failed == "in_wait" else StopError, match=r"gone|may still press with 0\.9\d N m"):
        run(robot)
    assert robot.elapsed < 1e-3 * AT + RULES.patience + 0.5


@pytest.mark.parametrize("readings", [True, False])
def test_after_a_gap_the_goal_is_where_the_fingers_are_now_if_that_can_be_known(readings: bool) -> None:
    """As after SIGSTOP and SIGCONT: somebody has moved the fingers in between."""
    robot = FollowingRobot(HOME, follow=0.0)

    def sleep(robot: FollowingRobot) -> None:
        robot.elapsed += 10.0
        robot.now += 10.0
        robot.q = HOME - 0.3

    robot.in_wait[AT].append(sleep)
    robot.in_read[AT].append(lost)
    if not readings:
        WAYS["no measurement"](robot)
    assert run(robot).reason.startswith("tick 10001 ms after")
    np.testing.assert_allclose(robot.sent[-1].q_d, HOME - 0.3 * readings, atol=1e-9)
    stopped = [one for one in robot.sent if one.mode is Mode.STOPPED]
    assert all(torque(one, LIMITS) <= LIMITS.torque + 1e-9 for one in stopped)


@pytest.mark.parametrize("name", SIGNALS)
def test_a_signal_lets_go_and_is_given_back(name: str) -> None:
    before = signal.getsignal(signal.Signals[name])
    robot = FollowingRobot(HOME, follow=0.0)
    robot.in_read[AT].append(killing(name))
    ended = run(robot)
    assert (ended.reason, ended.interrupted) == (f"interrupted by {name}", True)
    assert signal.getsignal(signal.Signals[name]) is before


def test_a_signal_breaks_what_hangs_but_neither_the_stop_nor_the_closing(monkeypatch: pytest.MonkeyPatch) -> None:
    def hang(robot: FollowingRobot) -> None:
        now[0] += 2.0
        os.kill(os.getpid(), signal.SIGINT)

    now = [0.0]
    monkeypatch.setattr(run_loop, "time", SimpleNamespace(monotonic=lambda: now[0], perf_counter=time.perf_counter))
    for call in ("in_wait", "in_read", "in_send"):
        robot = FollowingRobot(HOME, follow=0.0)
        for tick in (AT, AT + 1, AT + 2, AT + 60):
            getattr(robot, call)[tick].append(hang)
        with pytest.raises(KeyboardInterrupt):
            run(robot)

    class Closing(FollowingRobot):
        def close(self) -> None:
            os.kill(os.getpid(), signal.SIGINT)
            super().close()

    robot = Closing(HOME, follow=0.0)
    robot.in_wait[AT] += 3 * [killing("SIGINT")]
    assert run(robot).reason == "interrupted by SIGINT"


def test_an_ignored_signal_ends_nothing() -> None:
    handler = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    robot = FollowingRobot(HOME, follow=0.0)
    robot.in_read[AT].append(killing("SIGHUP"))
    assert run(robot).reason == "time is over"
    signal.signal(signal.SIGHUP, handler)


def test_a_slow_hold_takes_the_time_it_needs() -> None:
    slow = JointLimits(**vars(LIMITS) | {"rate": 0.1})
    robot = FollowingRobot(HOME, follow=0.0)
    robot.loop = ControlLoop(
        PlayedTargets(HOME[None] + 0.2), 0.02, slow, RULES, Homing(1.0, settle=0.05), 3.0, HAND, clock=robot.clock
    )
    assert drive(robot, slow, RULES).reason == "time is over"
    assert sum(one.mode is Mode.STOPPED for one in robot.sent) > 1500


@pytest.mark.timeout(300)
def test_ctrl_z_lets_go_then_suspends_and_ends_when_it_goes_on(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "tactile_cube.deploy", "seconds=600", "motion=holds", f"hydra.run.dir={tmp_path}"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, process_group=0) as command:
        assert command.stdout is not None
        assert any(line.startswith("running: ") for line in command.stdout)
        command.send_signal(signal.SIGTSTP)
        assert command.stdout.readline() == "stopped: interrupted by SIGTSTP\n"
        _, status = os.waitpid(command.pid, os.WUNTRACED)
        assert os.WIFSTOPPED(status)
        command.send_signal(signal.SIGCONT)
        assert command.wait() == 130


def test_the_simulated_hand_lets_go_by_itself_when_commands_cease() -> None:
    hand = SimulatedHand(cube=False, noise=0.0, resolution=0.0)
    for _ in range(50):
        hand.send(hand._world.q_m + 0.2)
        hand.wait()
    pressing = hand._q_d
    for _ in range(99):
        hand.wait()
    assert hand._q_d is pressing
    hand.wait()
    reading = hand.read()
    assert isinstance(reading, Reading)
    assert hand._q_d is not pressing
    np.testing.assert_allclose(hand._q_d, reading.q_m, atol=0.03)  # K_D brakes what moves
    hand.close()
