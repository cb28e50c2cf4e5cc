"""Where metrics go: CSV, TensorBoard, Weights & Biases."""

import csv
import hashlib
import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from tactile_cube.errors import InputError
from tactile_cube.whole_file import write_whole


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
