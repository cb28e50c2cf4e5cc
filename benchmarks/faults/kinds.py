"""The faults that a run must survive, at any moment or in a phase that chance seldom meets.

A full disk is a limit on the size of files, which gives the process the same kind of error. A file that cannot be
written is a folder in its place, which stops root too. A jump of the clock is not among them: training goes by the
monotonic clock alone (tests/benchmarks/faults/test_campaign.py).
"""

import os
import resource
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass

import psutil

from benchmarks.faults.command import Command


@dataclass(frozen=True)
class Phase:
    """A part of a run: how it is told that it has begun, and how long it lasts [s]."""

    begun: Callable[[Command], bool]
    seconds: float


@dataclass(frozen=True)
class Kind:
    """A kind of fault.

    Attributes:
        name: in the table.
        strike: does it to a running command; False when it had ended.
        undo: takes away what would keep the same command from going on.
        phase: in which it strikes; None: in the whole run.
    """

    name: str
    strike: Callable[[Command], bool]
    undo: Callable[[Command], None] = lambda command: None
    phase: Phase | None = None


def _main(*signals: int) -> Callable[[Command], bool]:
    def strike(command: Command) -> bool:
        if command.ended:
            return False
        try:
            for number in signals:
                os.kill(command.pid, number)
                time.sleep(0.1 if len(signals) > 1 else 0.0)
        except ProcessLookupError:  # one was enough
            return True
        return True

    return strike


def _worker(do: Callable[[psutil.Process], None]) -> Callable[[Command], bool]:
    def strike(command: Command) -> bool:
        deadline = time.monotonic() + 60.0
        while not command.ended and time.monotonic() < deadline:
            workers = command.workers()
            if workers:
                do(workers[0])
                return True
            time.sleep(0.1)
        return False

    return strike


def _little_memory(worker: psutil.Process) -> None:
    used = worker.memory_info().vms
    resource.prlimit(worker.pid, resource.RLIMIT_AS, (used, used))


def _wish(text: str) -> Callable[[Command], bool]:
    def strike(command: Command) -> bool:
        command.wish.write_text(text)
        return not command.ended

    return strike


def _no_wish(command: Command) -> None:
    command.wish.unlink(missing_ok=True)


def _full(command: Command) -> bool:
    if command.ended:
        return False
    resource.prlimit(command.pid, resource.RLIMIT_FSIZE, (20_000, 20_000))
    return True


def _blocked(command: Command) -> bool:
    (command.folder / "checkpoint_next.pt.partial").mkdir(exist_ok=True)
    return not command.ended


def _unblocked(command: Command) -> None:
    blocked = command.folder / "checkpoint_next.pt.partial"
    if blocked.is_dir():
        blocked.rmdir()


def _worker_there(command: Command) -> bool:
    return bool(command.workers())


def _all_logged(command: Command) -> bool:
    metrics = command.folder / "metrics.csv"
    return metrics.is_file() and metrics.read_text().count("\n") > command.rows


PHASES = {"while it starts": Phase(_worker_there, 1.0), "after the last iteration": Phase(_all_logged, 0.2)}
AT_ITS_ENDS = tuple(
    Kind(f"worker: {name} {words}", _worker(do), phase=phase)
    for name, do in (("SIGKILL", psutil.Process.kill), ("SIGSTOP", psutil.Process.suspend))
    for words, phase in PHASES.items()
)
"""What strikes workers that start, and those that are no longer needed once all rows of metrics.csv are there."""
KINDS = (
    Kind("main process: SIGKILL", _main(signal.SIGKILL)),
    Kind("worker: SIGKILL", _worker(psutil.Process.kill)),
    Kind("main process: SIGINT", _main(signal.SIGINT)),
    Kind("worker: SIGSTOP", _worker(psutil.Process.suspend)),
    Kind("main process: SIGTERM", _main(signal.SIGTERM)),
    Kind("worker: exception", _wish("raise"), _no_wish),
    Kind("main process: SIGINT twice", _main(signal.SIGINT, signal.SIGINT)),
    Kind("worker: NaN", _wish("nan"), _no_wish),
    Kind("disk full (size of files limited)", _full),
    Kind("worker: out of memory (limited)", _worker(_little_memory)),
    Kind("file cannot be written", _blocked, _unblocked),
)
