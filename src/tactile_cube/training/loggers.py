"""Where metrics go: the line on the terminal, CSV, TensorBoard, Weights & Biases."""

import csv
import hashlib
import io
import re
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, TextIO

from tactile_cube.errors import InputError
from tactile_cube.whole_file import write_whole

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


class MetricLogger(Protocol):
    """Takes rows of numbers.

    Built as `Logger(folder=run folder, resumed_at=steps, config=all settings of the run, **its own settings)`.
    """

    def log(self, steps: int, metrics: Mapping[str, float]) -> None:
        """Write one row at `steps` environment steps."""

    def close(self) -> None:
        """Write what is still in memory."""


class CsvLogger:
    """metrics.csv in the run folder; rows after the checkpoint that a run goes on from are dropped first."""

    def __init__(self, folder: Path, resumed_at: int, **_: object):
        self.path = folder / "metrics.csv"
        kept = _rows_until(resumed_at, self.path) if resumed_at and self.path.is_file() else []
        text = io.StringIO(newline="")
        csv.writer(text).writerows(kept)
        write_whole(self.path, text.getvalue().encode())
        self._columns: list[str] = kept[0] if kept else []
        self._file = self.path.open("a", newline="")

    def log(self, steps: int, metrics: Mapping[str, float]) -> None:
        """Write one row; the first row fixes the columns."""
        row = {"steps": steps, **{key: f"{value:.6g}" for key, value in metrics.items()}}
        if not self._columns:
            self._columns = list(row)
            csv.writer(self._file).writerow(self._columns)
        csv.writer(self._file).writerow([row.get(column, "") for column in self._columns])
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class TensorBoardLogger:
    """Event files in the run folder: `tensorboard --logdir outputs/train`."""

    def __init__(self, folder: Path, resumed_at: int, **_: object):
        from torch.utils.tensorboard import SummaryWriter  # imports slowly

        self._writer: Any = SummaryWriter(str(folder / "tensorboard"), purge_step=resumed_at + 1)

    def log(self, steps: int, metrics: Mapping[str, float]) -> None:
        """Write one point a curve."""
        for key, value in metrics.items():
            self._writer.add_scalar(key, value, steps)

    def close(self) -> None:
        """Close the event file."""
        self._writer.close()


class WandbLogger:
    """Weights & Biases (`pip install .[wandb]`): a run for each folder, grouped by the training or sweep it is part of.

    A run that goes on writes into its own again; one that starts over begins it anew.
    """

    def __init__(self, folder: Path, resumed_at: int, config: Mapping[str, Any], project: str = "tactile_cube"):
        try:
            import wandb  # type: ignore[import-not-found, unused-ignore]
        except ImportError:
            raise InputError("logger=wandb needs Weights & Biases: pip install 'tactile-cube[wandb]'") from None
        place = folder.resolve()
        name, digest = f"{place.parent.name}/{place.name}", hashlib.sha256(str(place).encode()).hexdigest()
        self._run: Any = wandb.init(
            project=project,
            group=place.parent.name,
            name=name,
            id=f"{re.sub(r'[^a-zA-Z0-9_.=-]', '_', name)[-100:]}-{digest[:8]}",  # W&B allows neither / nor : in it
            config=dict(config),
            dir=str(folder),
            resume="allow" if resumed_at else None,
        )

    def log(self, steps: int, metrics: Mapping[str, float]) -> None:
        """Send one row."""
        self._run.log(dict(metrics), step=steps)

    def close(self) -> None:
        """Finish the upload."""
        self._run.finish()


def _rows_until(steps: int, path: Path) -> list[list[str]]:
    """Header and rows up to `steps`, without a last row that a crash cut off; nothing where there are no rows."""
    lines = path.read_text().splitlines(keepends=True)
    head, *rows = list(csv.reader(line for line in lines if line.endswith("\n"))) or [[]]
    kept = [row for row in rows if len(row) == len(head) and float(row[0]) <= steps]
    return [head, *kept] if kept else []
