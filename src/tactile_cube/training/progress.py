"""The line that says how training goes."""

import sys
import time
from collections.abc import Mapping
from typing import TextIO

INTERVAL = 5.0
"""Seconds between two lines."""


class ProgressLine:
    """Prints steps, speed, mean final angle, curriculum and time left; in place on a terminal, line by line elsewhere.

    Args:
        total: environment steps of the whole run.
        steps: steps done before this session.
        updates: gradient steps done before this session.
        usual: environment steps after which recorded runs were done; None: all.
        stream: where to print.

    Attributes:
        stage: what each line begins with where the run is a stage of several.
        later: environment steps that the stages after it usually take.
    """

    def __init__(self, total: int, steps: int, updates: int, usual: int | None = None, stream: TextIO | None = None):
        self._total, self._usual, self._stream = total, min(usual or total, total), stream or sys.stdout
        self.stage, self.later = "", 0
        self._printed, self._at_print = time.perf_counter(), (steps, updates)

    def show(self, steps: int, updates: int, summary: Mapping[str, float], conditions: Mapping[str, float]) -> None:
        """Print if the last line is old enough.

        Args:
            steps: environment steps so far.
            updates: gradient steps so far.
            summary: statistics of episodes, see EpisodeStatistics.summary.
            conditions: the curriculum's values in force.
        """
        now = time.perf_counter()
        elapsed = now - self._printed
        if elapsed < INTERVAL:
            return
        step_rate, update_rate = (steps - self._at_print[0]) / elapsed, (updates - self._at_print[1]) / elapsed
        self._printed, self._at_print = now, (steps, updates)
        sooner = steps < self._usual < self._total
        end = self._usual if sooner else self._total
        left = (max(end - steps, 0) + self.later) / max(step_rate, 1e-9)  # the last barrier may lie beyond
        parts = [
            self.stage,
            f"{steps / 1e3:8.1f} k of {self._total / 1e3:.0f} k steps",
            f"{step_rate:4.0f} steps/s {update_rate:4.0f} updates/s",
            f"final angle {summary['final_angle']:5.2f} rad, {summary['episode_length']:3.0f} steps",
            f"{100 * summary['ended_time_limit']:.0f} % kept" if "ended_time_limit" in summary else "",
            " ".join(f"{key} {value:.3g}" for key, value in conditions.items()),
            f"{'usually' if sooner or self.later else 'at most'} {_clock(left)} left",
        ]
        self.say(" | ".join(filter(None, parts)), in_place=self._stream.isatty())

    def say(self, text: str, in_place: bool = False) -> None:
        """Print a line of its own, or over the last one."""
        clear = "\r\x1b[K" if self._stream.isatty() else ""
        print(f"{clear}{text}", end="" if in_place else "\n", file=self._stream, flush=True)


def _clock(seconds: float) -> str:
    hours, minutes = int(seconds // 3600), int(seconds % 3600 // 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {int(seconds % 60):02d} s"
