"""Signals that would end or suspend the program while a hand is under its commands."""

from __future__ import annotations

import os
import signal
import threading
import time
from types import FrameType, TracebackType
from typing import Any

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
DEADLY = (signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM, signal.SIGVTALRM, signal.SIGPROF, signal.SIGXCPU)
"""Signals that end a program which has no handler of its own for them."""
TERMINAL = (signal.SIGTTIN, signal.SIGTTOU)
"""Signals by which a terminal suspends a program in the background that reads or writes."""
PATIENCE = 1.0
"""After how long without a step a signal breaks what hangs [s]."""


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
