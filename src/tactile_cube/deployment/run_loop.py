"""Run the control loop on a hand until it stops, keep its log and its tick times."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tactile_cube.deployment.control_loop import ControlLoop, Mode
from tactile_cube.deployment.robot import Robot
from tactile_cube.deployment.run_log import RunLog

NO_HAND = 5.0  # [s] without any measurement at the beginning


@dataclass(frozen=True)
class LoopRun:
    """One run of the loop.

    Attributes:
        reason: why it ended.
        homed: whether the policy came to decide.
        log: of the time in which the policy decided.
        ticks: computing time of every tick [s], without the hand's own.
    """

    reason: str
    homed: bool
    log: RunLog
    ticks: list[float] = field(repr=False)

    @property
    def tick_times(self) -> dict[str, float]:
        """Median, 99.9th percentile and largest computing time of a tick [s]."""
        times = np.array(self.ticks)
        return {
            "median": float(np.median(times)),
            "p99.9": float(np.quantile(times, 0.999)),
            "largest": float(times.max()),
        }


def run_loop(loop: ControlLoop, robot: Robot, say: Callable[[str], None] = print) -> LoopRun:
    """Run the loop until it stops by itself; Ctrl-C stops the fingers where they are.

    Args:
        loop: a new one.
        robot: the hand.
        say: takes a line at each change of mode.
    """
    log, ticks, began = RunLog(), list[float](), robot.wait()
    try:
        while loop.mode is not Mode.STOPPED:
            mode, now = loop.mode, robot.wait()
            reading = robot.read()
            before = time.perf_counter()
            q_d = loop.tick(now, reading)
            ticks.append(time.perf_counter() - before)
            if q_d is not None:
                robot.send(q_d)
            if mode is Mode.RUNNING and q_d is not None:
                log.add(reading, q_d)
            if loop.mode is not mode:
                _announce(loop, robot, say)
            if loop.mode is Mode.WAITING and now - began > NO_HAND:
                loop.stop(f"no measurement within {NO_HAND:g} s")
    except KeyboardInterrupt:
        loop.stop("interrupted")
        robot.send(loop.q_d)
    say(f"stopped: {loop.reason}")
    return LoopRun(loop.reason, bool(log.time), log, ticks)


def _announce(loop: ControlLoop, robot: Robot, say: Callable[[str], None]) -> None:
    if loop.mode is Mode.HOMING:
        say("homing: the fingers go to the start angles")
    elif loop.mode is Mode.RUNNING:
        robot.hand_over()
        say(f"running: {loop.decider}")
