"""Run the control loop on a hand until it stops, keep its tick times."""

import os
import select
import sys
import termios
import time
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, field

import numpy as np

from tactile_cube.deployment.control_loop import ControlLoop, Mode
from tactile_cube.deployment.loop_log import LoopLog
from tactile_cube.deployment.robot import Robot
from tactile_cube.deployment.signals import NotedSignals
from tactile_cube.deployment.stop import let_go

NO_HAND = 5.0  # [s] without believable measurements at the beginning
TICK_TIMES = {"median": 0.5, "p99.9": 0.999, "largest": 1.0}
Say = Callable[[str], None]


@dataclass
class LoopRun:
    """One run of the loop: why it ended and whether by a signal.

    `ended` is on the robot's clock [s]; `ticks` counts the ticks by their computing time [us], without the hand's own.
    """

    reason: str = ""
    interrupted: bool = False
    ended: float = 0.0
    ticks: Counter[int] = field(default_factory=Counter, repr=False)

    @property
    def tick_times(self) -> dict[str, float]:
        """Median, 99.9th percentile and largest computing time of a tick [s]."""
        times, counts = np.array(sorted(self.ticks.items())).T
        places = np.searchsorted(np.cumsum(counts), [q * counts.sum() for q in TICK_TIMES.values()])
        return dict(zip(TICK_TIMES, (1e-6 * times[places]).tolist(), strict=True))


def run_loop(loop: ControlLoop, robot: Robot, say: Say = print, log: LoopLog | None = None) -> LoopRun:
    """Run a new loop until it stops by itself or a signal ends it.

    However it ends, by an exception too, the stop has the last commands and the robot is closed.

    Args:
        loop: a new one.
        robot: the hand.
        say: takes a line at each change of mode.
        log: of the time in which the policy decides.

    Raises:
        StopError: the fingers may still press.
        BaseException: what a method of the robot or the policy raised.
    """
    run = LoopRun()
    with NotedSignals() as signals, closing(robot):
        try:
            loop.warm_up()
            _until_stopped(loop, robot, say, run, signals, log)
        except BaseException as error:
            loop.stop(f"{type(error).__name__}: {error}")
            raise
        finally:
            let_go(loop.stop("the reason cannot be told"), robot, signals.alive)
            say(f"{loop.mode}: {loop.doing}")
    run.reason, run.interrupted = loop.reason, bool(signals.names)
    return run


def _until_stopped(
    loop: ControlLoop, robot: Robot, say: Say, run: LoopRun, signals: NotedSignals, log: LoopLog | None
) -> None:
    said, began, key = loop.mode, robot.wait(), EnterKey()
    while loop.mode is not Mode.STOPPED:
        signals.alive()
        now = run.ended = robot.wait()
        _tick(loop, robot, now, run, log)
        changed = loop.mode is not said
        if changed:
            said, key = loop.mode, EnterKey()
        given = loop.mode is Mode.WAIT_FOR_OBJECT and (robot.wait_for_object() or key.pressed())
        if changed and not loop.reason:
            _announce(loop, robot, say, ", then press Enter" if key.usable and not given else "")
        if given:
            loop.confirm_object()
        if loop.mode is Mode.WAITING and now - began > NO_HAND:
            loop.stop(f"no measurement within {NO_HAND:g} s")
        if signals.names:
            loop.stop(f"interrupted by {signals.names[0]}")


def _tick(loop: ControlLoop, robot: Robot, now: float, run: LoopRun, log: LoopLog | None) -> None:
    running, before, reading = loop.mode is Mode.RUNNING, loop.accepted, robot.read()
    began = time.perf_counter()
    q_d = loop.tick(now, reading)
    run.ticks[round(1e6 * (time.perf_counter() - began))] += 1
    if q_d is None:
        return
    robot.send(q_d.copy())  # what is sent is the robot's
    loop.sent()
    if log is not None and running and loop.accepted is not None and loop.accepted is not before:
        log.append(loop.accepted, q_d)


def _announce(loop: ControlLoop, robot: Robot, say: Say, key: str) -> None:
    if loop.mode is Mode.RUNNING:
        robot.release()
    say(f"{loop.mode}: {loop.doing}" + (key if loop.mode is Mode.WAIT_FOR_OBJECT else ""))


class EnterKey:
    """Enter on the terminal, where there is one to read from, from now on: what was typed before does not count."""

    def __init__(self) -> None:
        self.usable = sys.stdin is not None and sys.stdin.isatty() and _in_front(sys.stdin.fileno())
        if self.usable:
            termios.tcflush(sys.stdin, termios.TCIFLUSH)

    def pressed(self) -> bool:
        """Whether Enter has been pressed; never waits, not for the rest of a line either."""
        if not self.usable or not select.select([sys.stdin], [], [], 0.0)[0]:
            return False
        return b"\n" in os.read(sys.stdin.fileno(), 4096)


def _in_front(terminal: int) -> bool:
    """Whether this process may read the terminal: one in the background is stopped when it tries."""
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    except OSError:  # not the one that this process is controlled from
        return True
