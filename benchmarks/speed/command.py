"""Time and memory of a command, from start to end, as a user types it."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

LIMIT = "OMP_NUM_THREADS"
POLL = 0.2
TIMEOUT = 300.0


@dataclass(frozen=True)
class Watched:
    """Time and memory of a command.

    Attributes:
        wall: time on the clock [s].
        cpu: processor time of it and of the children it waited for [s].
        memory: the most that it and its children had at a time [GiB]; 0 where nobody watched or there is no /proc.
    """

    wall: float
    cpu: float
    memory: float


def run_and_watch(words: Sequence[str], threads: int | None = None, memory: bool = False) -> Watched:
    """Run `python -m words...` in a folder of its own.

    Args:
        words: module and its arguments.
        threads: of numerical libraries; None: as many as they like.
        memory: whether to look at the memory all the time, which takes a part of a core.

    Raises:
        RuntimeError: the command failed; with its last words.
    """
    command = [sys.executable, "-m", *words]
    environment = {key: value for key, value in os.environ.items() if key != LIMIT}
    if threads is not None:
        environment[LIMIT] = str(threads)
    with tempfile.TemporaryDirectory() as folder, Path(folder, "log").open("w+") as log:
        began, cpu, most = time.perf_counter(), _children_cpu(), 0.0
        process = subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=log)
        try:
            while memory and process.poll() is None and time.perf_counter() - began < TIMEOUT:
                most = max(most, _tree_memory(process.pid))
                time.sleep(POLL)
            process.wait(timeout=TIMEOUT - (time.perf_counter() - began))
        except subprocess.TimeoutExpired as error:
            raise RuntimeError(f"{' '.join(command)} has not ended after {TIMEOUT:g} s") from error
        finally:
            process.terminate()
            process.wait(timeout=30)
        seconds = time.perf_counter() - began
        if process.returncode != 0:
            log.seek(0)
            raise RuntimeError(f"{' '.join(command)} failed: {log.read().strip()[-300:]}")
    return Watched(seconds, _children_cpu() - cpu, most)


def _children_cpu() -> float:
    """Processor time of all children that have ended [s]."""
    times = os.times()
    return times.children_user + times.children_system


def _tree_memory(root: int) -> float:
    """Proportional memory of a process and its descendants [GiB]."""
    parents = {int(path.name): _parent(path) for path in Path("/proc").glob("[0-9]*")}
    family, grown = {root}, True
    while grown:
        more = {pid for pid, parent in parents.items() if parent in family} - family
        family, grown = family | more, bool(more)
    return sum(_proportional_kib(pid) for pid in family) / 2**20


def _parent(folder: Path) -> int:
    try:
        return int((folder / "stat").read_text().rpartition(")")[2].split()[1])
    except (OSError, IndexError, ValueError):
        return -1


def _proportional_kib(pid: int) -> int:
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
