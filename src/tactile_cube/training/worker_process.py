"""A simulation worker as a process: how it is begun, given weights, called without a wait, and left."""

import ctypes
import os
import queue
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any, TypeVar

import torch
from torchrl.weight_update import SharedMemWeightSyncScheme, WeightSyncScheme

T = TypeVar("T")


class WeightSync(SharedMemWeightSyncScheme):  # type: ignore[misc]
    """Weights in shared memory, without a farewell: workers are killed, and nobody waits for what they do not read.

    torchrl's own sends "stop" when it is deleted. Where that is at the end of the interpreter, the thread that a
    queue's first item starts never runs, and the program never ends.
    """

    def init_on_sender(self, *args: Any, **kwargs: Any) -> None:
        """Make the queues."""
        super().init_on_sender(*args, **kwargs)
        for queues in (self._weight_init_queues, self._instruction_queues, self._ack_queues):
            for one in queues.values():
                one.cancel_join_thread()

    @property
    def processes(self) -> list[Any]:
        """The workers so far, while they are still being started too."""
        return list(getattr(self.context, "procs", ()))

    def shutdown(self) -> None:
        """End the thread that receives weights, in a worker."""
        WeightSyncScheme.shutdown(self)


class Background:
    """A daemon thread that runs submitted calls one after another, so that none is waited for without a time limit.

    Daemonic, because a call may be stuck in a pipe to a dead process, and that must not keep the program from ending.
    One for all calls, because a worker ends with the thread that started it (`prepare_worker`).
    """

    def __init__(self) -> None:
        self._calls: queue.SimpleQueue[tuple[Future[object], Callable[[], object]] | None] = queue.SimpleQueue()
        threading.Thread(target=self._run, daemon=True, name="collection").start()

    def submit(self, call: Callable[[], T]) -> "Future[T]":
        """Queue a call; its result or exception arrives in the future."""
        future: Future[T] = Future()
        self._calls.put((future, call))  # type: ignore[arg-type]
        return future

    def close(self) -> None:
        """End the thread after the calls already queued."""
        self._calls.put(None)

    def _run(self) -> None:
        while (entry := self._calls.get()) is not None:
            future, call = entry
            try:
                future.set_result(call())
            except BaseException as error:  # noqa: BLE001, RUF100 - handed to whoever asks for the result
                future.set_exception(error)


def prepare_worker(parent: int | None) -> None:
    """Leave Ctrl-C to the main process `parent`, and end with it even if it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    torch.set_num_threads(1)
    if os.uname().sysname == "Linux":
        pr_set_pdeathsig = 1
        ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGKILL)  # SIGTERM would not reach a stopped process
        if parent is not None and os.getppid() != parent:  # it ended before
            os._exit(1)


def cpu_seconds(process: Any) -> float:
    """User and system time of a running process [s], from /proc; 0 for one that is closed already."""
    try:
        fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    except (OSError, ValueError):
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
