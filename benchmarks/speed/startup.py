"""Section: how long a user waits, and how much memory a run takes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.speed.command import Watched, run_and_watch
from benchmarks.speed.report import Figure, Section

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
        section.figures += _waiting(name, [run_and_watch(words, threads=1) for _ in range(rounds)], limit)
    if trains:
        run = run_and_watch(TRAIN, threads=1, memory=True)
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
