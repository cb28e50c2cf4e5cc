"""The learning curve of a training run, and when regrasping began."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

from tactile_cube.errors import InputError

ANGLE, STEPS = "final_angle", "steps"
CURRICULUM = ("T_s", "gravity")
"""What a curriculum moves, [s] and share of the weight."""
COSTS = ("simulating_hours", "learning_hours")
REGRASPING = 3.0
"""Mean final angle [rad] that shows regrasping in training: with starts turned by up to 43 deg a single twist comes to
2 rad and more, and in part of the episodes a gait may act that reaches 2.5 to 3 rad."""
WINDOW_FILL = 50
"""The mean is taken over so many episodes; before that many have ended it says nothing."""


@dataclass(frozen=True)
class Curve:
    """One training run.

    Attributes:
        label: for the legend.
        columns: columns of its metrics.csv by name, each as long as the file has rows.
    """

    label: str
    columns: dict[str, list[float]]


def read_curve(path: Path, label: str) -> Curve:
    """Read the metrics.csv of a run.

    Args:
        path: the file or the run's folder.
        label: for the legend.

    Raises:
        InputError: the file is missing, or lacks steps or the mean final angle.
    """
    file = path / "metrics.csv" if path.is_dir() else path
    try:
        with file.open(newline="", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from error
    for column in (STEPS, ANGLE):
        if not rows or column not in rows[0]:
            raise InputError(f"{file}: no column {column!r}; give the metrics.csv of a training run")
    return Curve(label, {name: [float(row[name] or "nan") for row in rows] for name in rows[0]})


def curriculum_ends(curve: Curve) -> list[int]:
    """Return the rows in which the curriculum begins and ends, or nothing where it never moved."""
    columns = [curve.columns[name] for name in CURRICULUM if name in curve.columns]
    values = list(zip(*columns, strict=True))
    moving = [row for row in range(1, len(values)) if values[row] != values[row - 1]]
    return [moving[0], moving[-1]] if moving else []


def regrasping_begins(curve: Curve) -> int | None:
    """Return the row in which the mean final angle of the last 50 episodes first exceeds `REGRASPING`, or None."""
    episodes = curve.columns.get("episodes", [WINDOW_FILL] * len(curve.columns[STEPS]))
    for index, (angle, count) in enumerate(zip(curve.columns[ANGLE], episodes, strict=True)):
        if count >= WINDOW_FILL and angle > REGRASPING:
            return index
    return None


def cpu_hours(curve: Curve, index: int) -> float:
    """Return the processor time spent on simulating and learning up to a row [h]."""
    return sum(curve.columns[name][index] for name in COSTS if name in curve.columns)
