"""Time competitors in turns, so that whatever else the machine does hits all of them alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Timing:
    """Seconds a call, one number a sample.

    Attributes:
        cpu: processor time of this process.
        wall: time on the clock.
    """

    cpu: list[float] = field(default_factory=list)
    wall: list[float] = field(default_factory=list)

    @property
    def quartiles(self) -> tuple[float, float, float]:
        """Lower quartile, median and upper quartile of the processor time a call [s]."""
        low, median, high = np.quantile(self.cpu, [0.25, 0.5, 0.75])
        return float(low), float(median), float(high)


def sample(call: Callable[[], object], calls: int, into: Timing) -> None:
    """Time `calls` calls as one sample."""
    wall, cpu = time.perf_counter(), time.process_time()
    for _ in range(calls):
        call()
    into.cpu.append((time.process_time() - cpu) / calls)
    into.wall.append((time.perf_counter() - wall) / calls)


def in_turns(cases: Mapping[str, Callable[[], object]], rounds: int, calls: int) -> dict[str, Timing]:
    """Time each case once a round, after one call that is not counted.

    Args:
        cases: what to time, by name.
        rounds: samples a case.
        calls: calls a sample.
    """
    timings = {name: Timing() for name in cases}
    for call in cases.values():
        call()
    for _ in range(rounds):
        for name, call in cases.items():
            sample(call, calls, timings[name])
    return timings
