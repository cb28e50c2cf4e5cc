"""What a terminal adds to the control loop: Enter confirms, and signals end it in order."""

from __future__ import annotations

import select
import signal
import sys
import termios
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class EnterKey:
    """Enter on the terminal, from now on: what was typed before does not count.

    Attributes:
        usable: whether there is a terminal to type at.
    """

    def __init__(self) -> None:
        self.usable = sys.stdin is not None and sys.stdin.isatty()
        if self.usable:
            termios.tcflush(sys.stdin, termios.TCIFLUSH)

    def pressed(self) -> bool:
        """Whether Enter has been pressed; never waits."""
        return self.usable and bool(select.select([sys.stdin], [], [], 0.0)[0]) and sys.stdin.readline() != ""


@contextmanager
def noted_signals() -> Iterator[list[str]]:
    """Note SIGINT (Ctrl-C), SIGTERM and SIGHUP by name instead of ending the program.

    The second one raises KeyboardInterrupt. A signal that was ignored at the start, as by nohup, stays ignored.
    """
    noted: list[str] = []

    def note(number: int, frame: FrameType | None) -> None:
        noted.append(signal.Signals(number).name)
        if len(noted) > 1:
            raise KeyboardInterrupt

    kinds = ENDING if threading.current_thread() is threading.main_thread() else ()
    before = {kind: signal.signal(kind, note) for kind in kinds if signal.getsignal(kind) is not signal.SIG_IGN}
    try:
        yield noted
    finally:
        for kind, handler in before.items():
            signal.signal(kind, handler)
