"""Run the control loop on a hand until it stops or a signal ends it; keep its tick times."""

from __future__ import annotations

import os
import select
import signal
import sys
import termios
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass, field
from types import FrameType, TracebackType
from typing import Any

import numpy as np

from tactile_cube.deployment.command_guard import let_go
from tactile_cube.deployment.control_loop import ControlLoop, Mode
from tactile_cube.deployment.loop_log import LoopLog
from tactile_cube.deployment.robot import Robot

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
DEADLY = (signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM, signal.SIGVTALRM, signal.SIGPROF, signal.SIGXCPU)
"""Signals that end a program which has no handler of its own for them."""
TERMINAL = (signal.SIGTTIN, signal.SIGTTOU)
"""Signals by which a terminal suspends a program in the background that reads or writes."""
PATIENCE = 1.0  # after how long without a step a signal breaks what hangs [s]


class NotedSignals:
    """Context in which signals are noted by name instead of ending or suspending the program.

    A signal raises KeyboardInterrupt only where no step, said by `alive`, has come for `PATIENCE`. One that was ignored
    at the start, as by nohup, stays ignored. A suspension (Ctrl-Z) is made up for at the end.
    """

    def __init__(self) -> None:
        self.names: list[str] = []
        self._before: dict[signal.Signals, Any] = {}
        self._stepped = time.monotonic()

    def alive(self) -> None:
        """Say that nothing hangs."""
        self._stepped = time.monotonic()

    def __enter__(self) -> NotedSignals:
        self.alive()
        if threading.current_thread() is threading.main_thread():
            taken = [kind for kind in (*ENDING, *TERMINAL) if signal.getsignal(kind) is not signal.SIG_IGN]
            taken += [kind for kind in DEADLY if signal.getsignal(kind) is signal.SIG_DFL]
            for kind in taken:
                self._before[kind] = signal.signal(kind, signal.SIG_IGN if kind in TERMINAL else self._note)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        if signal.SIGTSTP.name in self.names:
            os.kill(os.getpid(), signal.SIGTSTP)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.names.append(signal.Signals(number).name)
        if time.monotonic() - self._stepped > PATIENCE:
            self.alive()
            raise KeyboardInterrupt


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
    """Run a new loop until it stops by itself or a signal ends it; `log` is of the time in which the policy decides.

    However it ends, by an exception too, the stop has the last commands and the robot is closed.

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
            if loop.mode is Mode.RUNNING:
                robot.release()
            asked = loop.mode is Mode.WAIT_FOR_OBJECT and key.usable and not given
            say(f"{loop.mode}: {loop.doing}{', then press Enter' * asked}")
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


class EnterKey:
    """Enter on the terminal, where there is one to read from, from now on: what was typed before does not count."""

    def __init__(self) -> None:
        self.usable = sys.stdin is not None and sys.stdin.isatty()
        with suppress(OSError):  # else: not the terminal that this process is controlled from
            # a process in the background is stopped when it tries to read
            self.usable = self.usable and os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
        if self.usable:
            termios.tcflush(sys.stdin, termios.TCIFLUSH)

    def pressed(self) -> bool:
        """Whether Enter has been pressed; never waits, not for the rest of a line either."""
        if not self.usable or not select.select([sys.stdin], [], [], 0.0)[0]:
            return False
        return b"\n" in os.read(sys.stdin.fileno(), 4096)
