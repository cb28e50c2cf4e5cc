"""Time competitors in turns, so that whatever else the machine does hits all of them alike."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

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


PACKAGES = ("torch", "torchrl", "pybullet", "numpy", "numba", "mujoco", "stable-baselines3")


def machine() -> dict[str, str]:
    """Processor, cores, load, system, Python and packages, in words."""
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    found = {
        "processor": _processor(),
        "cores": str(_cores()),
        "load before": load,
        "system": f"{platform.system()} {platform.machine()}",
        "Python": platform.python_version(),
    }
    return found | {name: version for name in PACKAGES if (version := _version(name))}


def busy() -> bool:
    """Whether other programs take a core or more, so that times on the clock say little."""
    return hasattr(os, "getloadavg") and os.getloadavg()[0] > 0.7 * _cores()


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown"


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None
