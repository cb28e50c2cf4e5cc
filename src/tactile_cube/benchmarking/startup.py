"""Section: how long a user waits, and how much memory a run takes."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_cube.benchmarking.report import Figure, Section

COMMANDS = {
    "--help": (["tactile_cube.train", "--help"], 1.0),
    "--cfg job": (["tactile_cube.train", "--cfg", "job"], 1.0),
}
"""What is typed, and the longest it may take [s]."""
TRAIN = [
    "tactile_cube.train",
    "+experiment=table",
    "training.steps=300",
    "training.barrier_iterations=1",
    "training.resume=never",
    "logger=csv",
]
TRAIN_LIMIT = 15.0
MEMORY_LIMIT = 4.0
POLL = 0.2
TIMEOUT = 300.0


def startup(rounds: int, commands: Sequence[str] = tuple(COMMANDS), trains: bool = True) -> Section:
    """Wall time of short commands and of a training run of one iteration, from start to end.

    Args:
        rounds: how often each command is run.
        commands: names of `COMMANDS`.
        trains: whether to run the training too.
    """
    section = Section("startup", "wall time of commands; the training run collects 300 steps in 12 worlds and ends")
    for name in commands:
        words, limit = COMMANDS[name]
        section.figures += _waiting(name, [run_and_watch(words) for _ in range(rounds)], limit)
    if trains:
        run = run_and_watch(TRAIN)
        section.figures += _waiting("first training iteration, start to end", [run], TRAIN_LIMIT)
        if run.memory > 0.0:
            note = f"limit {MEMORY_LIMIT:g} GiB"
            section.figures.append(_spread("memory of its processes together", [run.memory], "GiB", note))
    return section


def _waiting(name: str, runs: Sequence[Watched], limit: float) -> list[Figure]:
    """Times on the clock, which a limit is about, and of the processor, which other programs touch less."""
    note = f"limit {limit:g} s"
    return [_spread(name, [run.wall for run in runs], "s", note), _spread(name, [run.cpu for run in runs], "CPU s")]


def _spread(name: str, values: Sequence[float], unit: str, note: str = "") -> Figure:
    low, median, high = (float(value) for value in np.quantile(values, [0.25, 0.5, 0.75]))
    return Figure(name, median, low, high, unit, note=note)


@dataclass(frozen=True)
class Watched:
    """What a command took.

    Attributes:
        wall: time on the clock [s].
        cpu: processor time of it and of the children it waited for [s].
        memory: the most that it and its children had at a time [GiB]; 0 where there is no /proc.
    """

    wall: float
    cpu: float
    memory: float


def run_and_watch(words: Sequence[str]) -> Watched:
    """Run `python -m words...` in a folder of its own.

    Raises:
        RuntimeError: the command failed; with its last words.
    """
    command = [sys.executable, "-m", *words]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as folder, Path(folder, "log").open("w+") as log:
        began, cpu, most = time.perf_counter(), _children_cpu(), 0.0
        process = subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=log)
        try:
            while process.poll() is None and time.perf_counter() - began < TIMEOUT:
                most = max(most, _tree_memory(process.pid))
                time.sleep(POLL if most > 1.0 else 0.01)
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
