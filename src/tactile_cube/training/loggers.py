"""Where metrics go: the line on the terminal, metrics.csv, and one of TorchRL's loggers."""

import csv
import hashlib
import io
import re
import sys
import time
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import torch
from PIL import Image, ImageSequence
from torchrl.record.loggers import get_logger
from torchrl.record.loggers.common import Logger

from tactile_cube.errors import InputError
from tactile_cube.training.settings import Reference
from tactile_cube.whole_file import write_whole

INTERVAL, LOOK_BACK = 5.0, 180.0
"""Seconds between two lines, and over which the speed is taken: a busy machine makes no step for many seconds."""


class ProgressLine:
    """Prints steps, speed, mean final angle, curriculum and time left; in place on a terminal, line by line elsewhere.

    Args:
        total: environment steps of the whole run.
        steps: steps done before this session.
        updates: gradient steps done before this session.
        reference: what recorded runs came to.
        stream: where to print.

    Attributes:
        stage: what each line begins with where the run is a stage of several.
        later: environment steps that the stages after it usually take.
    """

    def __init__(self, total: int, steps: int, updates: int, reference: Reference = (), stream: TextIO | None = None):
        self._total, self._reference, self._stream = total, reference, stream or sys.stdout
        self.stage, self.later = "", 0
        self._printed = time.perf_counter()
        self._past = deque([(self._printed, steps, updates)])

    def show(self, steps: int, updates: int, summary: Mapping[str, float], conditions: Mapping[str, float]) -> None:
        """Print if the last line is old enough.

        Args:
            steps: environment steps so far.
            updates: gradient steps so far.
            summary: statistics of episodes, see EpisodeStatistics.summary.
            conditions: the curriculum's values in force.
        """
        now = time.perf_counter()
        if now - self._printed < INTERVAL:
            return
        self._printed = now
        self._past.append((now, steps, updates))
        while len(self._past) > 2 and now - self._past[1][0] > LOOK_BACK:
            self._past.popleft()
        began, *done = self._past[0]
        step_rate, update_rate = (steps - done[0]) / (now - began), (updates - done[1]) / (now - began)
        band = self._band(steps)
        parts = [
            self.stage,
            f"{steps / 1e3:8.1f} k of {self._total / 1e3:.0f} k steps",
            f"{step_rate:4.0f} steps/s {update_rate:4.0f} updates/s",
            f"final angle {summary['final_angle']:5.2f} rad{band}, {summary['episode_length']:3.0f} steps",
            f"{100 * summary['ended_time_limit']:.0f} % kept" if "ended_time_limit" in summary else "",
            " ".join(f"{key} {value:.3g}" for key, value in conditions.items()),
            self._left(steps, step_rate),
        ]
        self.say(" | ".join(filter(None, parts)), in_place=self._stream.isatty())

    def _band(self, steps: int) -> str:
        """Describe the range of recorded runs at so many steps; "" where none got there."""
        known, *edges = zip(*self._reference, strict=True) if self._reference else ((),)
        if not known or not known[0] <= steps <= known[-1]:
            return ""
        low, high = (np.interp(steps, known, edge) for edge in edges)
        return f" (recorded runs {low:.2f} to {high:.2f})"

    def _left(self, steps: int, rate: float) -> str:
        """Describe the time left: to the end of recorded runs, beyond that to the last step."""
        usual = self._reference[-1][0] if self._reference else self._total
        sooner = steps < usual < self._total
        ahead = max((usual if sooner else self._total) - steps, 0) + self.later  # the last barrier may lie beyond
        if rate <= 0.0:
            return "time left unknown"
        hours, seconds = divmod(ahead / rate, 3600)
        clock = (
            f"{hours:.0f} h {seconds // 60:02.0f} min" if hours else f"{seconds // 60:.0f} min {seconds % 60:02.0f} s"
        )
        return f"{'usually' if sooner or self.later else 'at most'} {clock} left"

    def say(self, text: str, in_place: bool = False) -> None:
        """Print a line of its own, or over the last one."""
        clear = "\r\x1b[K" if self._stream.isatty() else ""
        print(f"{clear}{text}", end="" if in_place else "\n", file=self._stream, flush=True)


class MetricsTable:
    """metrics.csv in the run folder; rows after the checkpoint that a run goes on from are dropped first."""

    def __init__(self, folder: Path, resumed_at: int):
        self.path, self._columns = folder / "metrics.csv", list[str]()
        self._begin(_rows_until(resumed_at, self.path) if resumed_at and self.path.is_file() else [])

    def _begin(self, rows: list[list[str]]) -> None:
        """Write header and rows, and go on behind them."""
        text = io.StringIO(newline="")
        csv.writer(text).writerows(rows)
        write_whole(self.path, text.getvalue().encode())
        self._columns = rows[0] if rows else []
        self._file = self.path.open("a", newline="")

    def add(self, steps: int, metrics: Mapping[str, float]) -> None:
        """Write one row; a column that is new is empty in the rows before."""
        row = {"steps": steps, **{key: f"{value:.6g}" for key, value in metrics.items()}}
        if new := [key for key in row if key not in self._columns]:
            self.close()
            head, *rows = _rows_until(steps, self.path) or [[]]
            self._begin([[*head, *new], *([*one, *[""] * len(new)] for one in rows)])
        csv.writer(self._file).writerow([row.get(column, "") for column in self._columns])
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _rows_until(steps: int, path: Path) -> list[list[str]]:
    """Return header and rows up to `steps`, without a last row that a crash cut off; nothing without rows."""
    lines = path.read_text().splitlines(keepends=True)
    head, *rows = list(csv.reader(line for line in lines if line.endswith("\n"))) or [[]]
    kept = [row for row in rows if len(row) == len(head) and float(row[0]) <= steps]
    return [head, *kept] if kept else []


def open_logger(
    folder: Path, resumed_at: int, config: Mapping[str, Any], backend: str | None = None, project: str = "tactile_cube"
) -> Logger | None:
    """Return TorchRL's logger of a backend, in the run folder; None without one.

    In Weights & Biases a folder is a run of its own, grouped by the training or sweep it is part of; one that goes on
    writes into its own again, one that starts over begins it anew.

    Args:
        folder: of the run.
        resumed_at: environment steps at its start.
        config: all its settings.
        backend: what TorchRL's `get_logger` knows: tensorboard, wandb, csv, mlflow or trackio.
        project: in Weights & Biases, trackio and the like.

    Raises:
        InputError: there is no such backend, or it is not installed.
    """
    if not backend:
        return None
    place = folder.resolve()
    name, digest = f"{place.parent.name}/{place.name}", hashlib.sha256(str(place).encode()).hexdigest()
    wandb = {
        "project": project,
        "group": place.parent.name,
        "id": f"{re.sub(r'[^a-zA-Z0-9_.=-]', '_', name)[-100:]}-{digest[:8]}",  # W&B allows neither / nor : in it
        "config": dict(config),
        "resume": "allow" if resumed_at else None,
    }
    shown = backend if backend in ("tensorboard", "csv") else name  # there it is a folder
    try:
        return get_logger(backend, str(folder), shown, wandb_kwargs=wandb, trackio_kwargs={"project": project})
    except (ImportError, NotImplementedError) as error:
        hint = "pip install 'tactile-cube[wandb]'" if backend == "wandb" else "choose tensorboard, wandb or csv"
        raise InputError(f"logger.backend={backend}: {error}; {hint}") from error


def log_film(logger: Logger, film: Path, steps: int) -> None:
    """Show a GIF in Weights & Biases, where moviepy is installed; TensorBoard's films need a moviepy of before 2."""
    if type(logger).__name__ != "WandbLogger":
        return
    with Image.open(film) as opened:
        frames = np.stack([np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(opened)])
    video = torch.from_numpy(frames).permute(0, 3, 1, 2)[None]
    try:
        logger.log_video("trial", video, step=steps, fps=5, format="gif")
    except Exception as error:
        print(f"{film}: not sent to Weights & Biases ({error})")
