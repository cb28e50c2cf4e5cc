"""One thread that talks to the worker processes, so that the learner never waits without a time limit."""

import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

T = TypeVar("T")


class Background:
    """A daemon thread that runs submitted calls one after another.

    Daemonic, because a call may be stuck in a pipe to a dead process, and that must not keep the program from ending.
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
