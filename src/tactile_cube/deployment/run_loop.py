"""Run the control loop on a hand until it stops, keep its log and its tick times."""

from __future__ import annotations

import os
import select
import signal
import sys
import termios
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import numpy as np
from numpy.typing import NDArray

from tactile_cube.deployment.control_loop import ControlLoop, Mode
from tactile_cube.deployment.limits import JointLimits
from tactile_cube.deployment.robot import Reading, Robot
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.hand.dlr_hand2 import REFLECTED_INERTIA, STATIC_FRICTION, STIFFNESS
from tactile_cube.measurement.recordings.description import Controller, Coupling, Description, Sensors, TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, write_recording

Array = NDArray[np.float64]


Log = list[tuple[Reading, Array]]
"""One run of the loop: each measurement that was believed, and the command `(joints,)` [rad] that was sent then."""


def write_runs(
    runs: Sequence[Log], folder: Path, limits: JointLimits, rate: float, resolution: float, hand: Hand = DLR_HAND2
) -> Path:
    """Write runs of the loop as one recording, a trial each: of the hand alone, for no object is described.

    The gains of `limits` are the controller's; `rate` is the fast loop's [Hz], `resolution` the sensors' [rad].
    """
    nominal = {"stiffness": STIFFNESS, "static_friction": STATIC_FRICTION, "reflected_inertia": REFLECTED_INERTIA}
    told = {key: hand.drive.get(key, value) for key, value in nominal.items()}
    chains = [hand.chain_joints(k) for k in range(len(hand.fingers))]
    description = Description(
        format=1,
        gravity=(hand.rotation.T @ (0.0, 0.0, -9.81)).tolist(),
        rate_hz=rate,
        joints=list(hand.joint_names),
        coupled={chain[link]: Coupling(joint=chain[leader]) for chain in chains for link, leader in hand.coupled()},
        controller=Controller(kp=limits.kp.tolist(), kd=limits.kd.tolist(), torque_limit=limits.torque),
        nominal={key: np.asarray(value).tolist() for key, value in told.items()},
        sensors=Sensors(read="before", position_resolution=resolution),
        trials=[TrialEntry(file="none")],
        source="log of the control loop",
    )
    tables = [_table(number, run) for number, run in enumerate(runs)]
    write_recording(folder, RecordingTables(description, hand.urdf(), tables))
    return folder


def _table(number: int, run: Log) -> TrialTable:
    """A run as a trial of kind `policy`, its time from 0 [s]."""
    entry = TrialEntry(file=f"trials/run_{number}.parquet", initialisation=number, kind="policy")
    time, position, command = (np.array(rows) for rows in zip(*((r.time, r.q_m, q_d) for r, q_d in run), strict=True))
    torques = [reading.torque for reading, _ in run if reading.torque is not None]
    measured = len(torques) == len(run) and not np.isnan(torques).any()
    return TrialTable(entry, time - time[0], command, position, np.array(torques) if measured else None)


NO_HAND = 5.0  # [s] without believable measurements at the beginning
HOLD_TICKS = 200  # of the hold once its command rests, so that a lost message does no harm
PATIENCE = 5.0  # [s] that the hold and the closing have before a further signal ends them
TICK = 0.001  # [s] of a robot that cannot wait any more
TICK_TIMES = {"median": 0.5, "p99.9": 0.999, "largest": 1.0}
Say = Callable[[str], None]


@dataclass
class LoopRun:
    """One run of the loop: why it ended and whether by a signal, and the log of the time in which the policy decided.

    `ended` is on the robot's clock [s]; `ticks` has the computing time of every tick [s], without the hand's own.
    """

    reason: str = ""
    interrupted: bool = False
    ended: float = 0.0
    log: Log = field(default_factory=list, repr=False)
    ticks: list[float] = field(default_factory=list, repr=False)

    @property
    def tick_times(self) -> dict[str, float]:
        """Median, 99.9th percentile and largest computing time of a tick [s]."""
        return {name: float(np.quantile(self.ticks, q)) for name, q in TICK_TIMES.items()}


def run_loop(loop: ControlLoop, robot: Robot, say: Say = print) -> LoopRun:
    """Run a new loop until it stops by itself or a signal ends it; `say` takes a line at each change of mode.

    However it ends, by an exception too, the hold is sent and the robot is closed.
    """
    run = LoopRun()
    with noted_signals(lambda: loop.mode is Mode.STOPPED) as signals, closing(robot):
        try:
            loop.warm_up()
            _until_stopped(loop, robot, say, run, signals)
        except BaseException as error:
            loop.stop(f"{type(error).__name__}: {error}")
            raise
        finally:
            _hold(loop, robot, run.ended)
            say(f"{loop.mode}: {loop.doing}")
    run.reason, run.interrupted = loop.reason, bool(signals)
    return run


def _until_stopped(loop: ControlLoop, robot: Robot, say: Say, run: LoopRun, signals: list[str]) -> None:
    said, began, key = loop.mode, robot.wait(), EnterKey()
    while loop.mode is not Mode.STOPPED:
        now = run.ended = robot.wait()
        _tick(loop, robot, now, run)
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
        if signals:
            loop.stop(f"interrupted by {signals[0]}")


def _tick(loop: ControlLoop, robot: Robot, now: float, run: LoopRun) -> None:
    running, before, reading = loop.mode is Mode.RUNNING, loop.accepted, robot.read()
    began = time.perf_counter()
    q_d = loop.tick(now, reading)
    run.ticks.append(time.perf_counter() - began)
    if q_d is not None:
        if running and loop.accepted is not None and loop.accepted is not before:
            run.log.append((loop.accepted, q_d.copy()))
        robot.send(q_d)


def _hold(loop: ControlLoop, robot: Robot, now: float) -> None:
    """Send the hold at once, then until it has come to rest at the limited rate, and `HOLD_TICKS` more."""
    lost: Exception | None = None
    broken: Exception | None = None
    before, resting = None, 0
    while resting < HOLD_TICKS:
        q_d = loop.tick(now)
        if q_d is None:
            return
        resting = resting + 1 if before is not None and np.array_equal(q_d, before) else 0
        before = q_d.copy()  # what is sent is the robot's
        try:
            robot.send(q_d)
            lost = None
        except Exception as error:  # the next message may get through
            lost = error
        if broken is None:
            try:
                now = robot.wait()
                continue
            except Exception as error:  # from here on by our own clock, which is late rather than early
                broken = error
        time.sleep(TICK)
        now += TICK
    if failure := lost or broken:
        raise failure


def _announce(loop: ControlLoop, robot: Robot, say: Say, key: str) -> None:
    if loop.mode is Mode.RUNNING:
        robot.release()
    say(f"{loop.mode}: {loop.doing}" + (key if loop.mode is Mode.WAIT_FOR_OBJECT else ""))


ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


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


@contextmanager
def noted_signals(stopped: Callable[[], bool]) -> Iterator[list[str]]:
    """Note SIGINT (Ctrl-C), SIGTERM and SIGHUP by name instead of ending the program.

    The second one raises KeyboardInterrupt, but once the loop has `stopped` only `PATIENCE` after the first.
    A signal that was ignored at the start, as by nohup, stays ignored.
    """
    noted: list[str] = []
    first = 0.0

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal first
        noted.append(signal.Signals(number).name)
        first = first or time.monotonic()
        if len(noted) > 1 and not (stopped() and time.monotonic() - first < PATIENCE):
            raise KeyboardInterrupt

    kinds = ENDING if threading.current_thread() is threading.main_thread() else ()
    before = {kind: signal.signal(kind, note) for kind in kinds if signal.getsignal(kind) is not signal.SIG_IGN}
    try:
        yield noted
    finally:
        for kind, handler in before.items():
            signal.signal(kind, handler)
