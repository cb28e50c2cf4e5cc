"""What the figures were measured on."""

from __future__ import annotations

import importlib.metadata
import os
import platform
from pathlib import Path

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
