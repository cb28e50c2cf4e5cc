"""Where metrics go: CSV, TensorBoard, Weights & Biases."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from tactile_cube.errors import InputError


class MetricLogger(Protocol):
    """Takes rows of numbers. Built as `Logger(folder=run folder, resumed_at=steps, **its own settings)`."""

    def log(self, steps: int, metrics: Mapping[str, float]) -> None:
        """Write one row at `steps` environment steps."""

    def close(self) -> None:
        """Write what is still in memory."""


class CsvLogger:
    """metrics.csv in the run folder; rows after the checkpoint that a run goes on from are dropped first."""

    def __init__(self, folder: Path, resumed_at: int):
        self.path = folder / "metrics.csv"
        rows = _read_rows(self.path) if resumed_at else []
        kept = [row for row in rows if float(row["steps"]) <= resumed_at]
        self._columns: list[str] = list(kept[0]) if kept else []
        self._file = self.path.open("w", newline="")
        if kept:
            self._write_header()
            self._writer.writerows(kept)

    def _write_header(self) -> None:
        self._writer = csv.DictWriter(self._file, self._columns, extrasaction="ignore", restval="")
        self._writer.writeheader()

    def log(self, steps: int, metrics: Mapping[str, float]) -> None:
        """Write one row; the first row fixes the columns."""
        row = {"steps": steps, **{key: f"{value:.6g}" for key, value in metrics.items()}}
        if not self._columns:
            self._columns = list(row)
            self._write_header()
        self._writer.writerow(row)
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class TensorBoardLogger:
    """Event files in the run folder: `tensorboard --logdir outputs/train`."""

    def __init__(self, folder: Path, resumed_at: int):
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
    """Weights & Biases (`pip install .[wandb]`)."""

    def __init__(self, folder: Path, resumed_at: int, project: str = "tactile_cube"):
        try:
            import wandb  # type: ignore[import-not-found, unused-ignore]
        except ImportError:
            raise InputError("logger=wandb needs Weights & Biases: pip install 'tactile-cube[wandb]'") from None
        name = folder.name
        self._run: Any = wandb.init(project=project, name=name, id=name, dir=str(folder), resume="allow")

    def log(self, steps: int, metrics: Mapping[str, float]) -> None:
        """Send one row."""
        self._run.log(dict(metrics), step=steps)

    def close(self) -> None:
        """Finish the upload."""
        self._run.finish()


class Loggers:
    """Several loggers as one."""

    def __init__(self, loggers: Sequence[MetricLogger]):
        self._loggers = list(loggers)

    def log(self, steps: int, metrics: Mapping[str, float]) -> None:
        """Write one row everywhere."""
        for logger in self._loggers:
            logger.log(steps, metrics)

    def close(self) -> None:
        """Close all."""
        for logger in self._loggers:
            logger.close()


def _read_rows(path: Path) -> list[dict[str, str]]:
    if not path.is_file():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
