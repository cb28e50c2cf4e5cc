"""Ctrl-C: the run ends within seconds, at a point that it can go on from."""

import contextlib
import signal
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

PATIENCE = 10.0
"""Longest time [s] from Ctrl-C to the end."""


class Interruption:
    """While entered, Ctrl-C and SIGTERM end the run at the next barrier if that is near, else at once.

    At once is by KeyboardInterrupt: the run has been saved at the last barrier. So it is for a second Ctrl-C, and when
    the barrier takes longer than it promised.

    Args:
        seconds_to_barrier: expected time to the next barrier [s]; None while nobody knows.
        say: tells the user.

    Attributes:
        asked: the run shall end at the next barrier.
    """

    def __init__(self, seconds_to_barrier: Callable[[], float | None], say: Callable[[str], None]):
        self.asked = False
        self._seconds_to_barrier, self._say = seconds_to_barrier, say
        self._saving = False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> None:
        """Listen."""
        handlers = {signal.SIGINT: self._ctrl_c, signal.SIGTERM: self._ctrl_c, signal.SIGALRM: self._too_late}
        self._before = {number: signal.signal(number, handler) for number, handler in handlers.items()}

    def __exit__(self, *error: object) -> None:
        """Listen no longer."""
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in self._before.items():
            signal.signal(number, handler)

    @contextlib.contextmanager
    def not_by_the_clock(self) -> Iterator[None]:
        """A save that has begun in time is finished."""
        self._saving = True
        try:
            yield
        finally:
            self._saving = False

    def _ctrl_c(self, number: int, frame: FrameType | None) -> None:
        left = 0.0 if self._saving else self._seconds_to_barrier()
        if self.asked or left is None or left > PATIENCE:
            raise KeyboardInterrupt
        self.asked = True
        signal.setitimer(signal.ITIMER_REAL, PATIENCE)
        with contextlib.suppress(RuntimeError):  # the signal came in the middle of another line
            self._say(
                f"Ctrl-C: going on to the next barrier, where the run is saved, in {left:.0f} s; again to stop now"
            )

    def _too_late(self, number: int, frame: FrameType | None) -> None:
        if not self._saving:
            raise KeyboardInterrupt
