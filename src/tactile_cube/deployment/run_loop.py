"""Run the control loop on a hand until it stops or a signal ends it; its log becomes a recording."""

from __future__ import annotations

import os
import queue
import select
import signal
import sys
import termios
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from tactile_cube.deployment.command_guard import let_go
from tactile_cube.deployment.control_loop import ControlLoop, Mode
from tactile_cube.deployment.robot import Array, JointLimits, Reading, Robot
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.hand.dlr_hand2 import REFLECTED_INERTIA, STATIC_FRICTION, STIFFNESS
from tactile_cube.measurement.recordings.description import Controller, Coupling, Description, Sensors, TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, write_recording

Rows = NDArray[np.void]
"""Rows of a log: `time` [s] and `position`, `command` [rad], `torque` [N m] `(joints,)`, nan where not measured."""
CHUNK = 500  # rows that are written at a time: what a crash may cost
BEHIND = 20  # chunks that may wait for the disk


class LoopLog:
    """Log of accepted measurements and the commands sent at those times, in an `.npy` file that grows.

    A thread writes, so that no tick waits for the disk. Whenever the program ends, by a crash too, `numpy.load` reads
    the file up to the last chunk. Time counts from the first row.

    Args:
        path: file to write.
        joints: of the hand.
    """

    def __init__(self, path: Path, joints: int) -> None:
        self.path, self._joints = path, joints
        signals = [(name, "<f8", (joints,)) for name in ("position", "command", "torque")]
        self._type = np.dtype([("time", "<f8"), *signals])
        self._filling, self._filled, self._written = np.empty(CHUNK, self._type), 0, 0
        self._chunks: queue.Queue[Rows | None] = queue.Queue(BEHIND)
        self._failure: OSError | None = None
        self._began: float | None = None
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("wb")
        self._write(self._filling[:0])
        self._thread = threading.Thread(target=self._write_chunks, name="log", daemon=True)
        self._thread.start()

    def __enter__(self) -> LoopLog:
        return self

    def __exit__(self, *_: object) -> None:
        """Write the waiting rows and close the file.

        Raises:
            OSError: it could not be written.
        """
        self._chunks.put(self._filling[: self._filled])
        self._chunks.put(None)
        self._thread.join()
        self._file.close()
        if self._failure is not None:
            raise self._failure

    @property
    def rows(self) -> Rows:
        """The rows written so far, memory-mapped."""
        return np.asanyarray(np.load(self.path, mmap_mode="r" if self._written else None))

    def append(self, reading: Reading, command: Array) -> None:
        """Add a row.

        Raises:
            OSError: the disk is full, or too slow.
        """
        torque = np.nan if reading.torque is None else reading.torque
        self._began = reading.time if self._began is None else self._began
        row: Any = self._filling[self._filled]
        row["time"], row["torque"] = reading.time - self._began, torque
        row["position"], row["command"] = reading.q_m, command
        self._filled += 1
        if self._filled < CHUNK:
            return
        if self._failure is not None:
            raise self._failure
        try:
            self._chunks.put_nowait(self._filling)
        except queue.Full:
            raise OSError(f"{self.path}: the disk is {BEHIND * CHUNK} rows behind the loop") from None
        self._filling, self._filled = np.empty(CHUNK, self._type), 0

    def _write_chunks(self) -> None:
        while (chunk := self._chunks.get()) is not None:
            try:
                if self._failure is None:
                    self._write(chunk)
            except OSError as error:
                error.filename = error.filename or str(self.path)
                self._failure = error

    def _write(self, chunk: Rows) -> None:
        """Append rows; the header, whose length stays, counts them only when they are in the file."""
        self._file.write(chunk.tobytes())
        self._file.flush()
        self._written += len(chunk)
        self._file.seek(0)
        described = {"descr": npy.dtype_to_descr(self._type), "fortran_order": False, "shape": (self._written,)}
        npy.write_array_header_1_0(self._file, described)
        self._file.seek(0, 2)
        self._file.flush()


def write_runs(
    runs: Sequence[Rows], folder: Path, limits: JointLimits, rate: float, resolution: float, hand: Hand = DLR_HAND2
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
    tables = []
    for number, run in enumerate(runs):  # their signals stay on the disk
        entry = TrialEntry(file=f"trials/run_{number}.parquet", initialisation=number, kind="policy")
        measured = not np.isnan(run["torque"].min())  # a copy of them all would not fit into the memory
        signals = (run["time"], run["command"], run["position"], run["torque"] if measured else None)
        tables.append(TrialTable(entry, *signals))
    write_recording(folder, RecordingTables(description, hand.urdf(), tables))
    return folder


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
        """Report that the program is not hanging."""
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
    robot.send(q_d.copy())  # a copy: the robot may keep what it is sent
    loop.sent()
    if log is not None and running and loop.accepted is not None and loop.accepted is not before:
        log.append(loop.accepted, q_d)


class EnterKey:
    """Enter key of the terminal, if there is one; what was typed before does not count."""

    def __init__(self) -> None:
        self.usable = sys.stdin is not None and sys.stdin.isatty()
        with suppress(OSError):  # else: not the terminal that this process is controlled from
            # a process in the background is stopped when it tries to read
            self.usable = self.usable and os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
        if self.usable:
            termios.tcflush(sys.stdin, termios.TCIFLUSH)

    def pressed(self) -> bool:
        """Return whether Enter has been pressed; never wait, not even for the rest of a line."""
        if not self.usable or not select.select([sys.stdin], [], [], 0.0)[0]:
            return False
        return b"\n" in os.read(sys.stdin.fileno(), 4096)
