"""The learning curve of a training run, and when regrasping began."""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb
from pathlib import Path
from statistics import median

from tactile_cube.errors import InputError

ANGLE, STEPS = "final_angle", "steps"
CURRICULUM = ("T_s", "gravity")  # columns that a curriculum changes: [s] and share of the weight
MEDIANS = ("million steps: median (interval)", "angle at the end [rad]: median (interval)", "CPU hours of all runs")
COSTS = ("simulating_hours", "learning_hours")
REGRASPING = 3.0
"""Mean final angle [rad] that shows regrasping in training: with starts turned by up to 43 deg a single twist comes to
2 rad and more, and in part of the episodes a gait may act that reaches 2.5 to 3 rad."""
WINDOW_FILL = 50  # number of episodes that the mean is taken over; ignore the mean before that many have ended


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


def regrasping_begins(curve: Curve) -> int | None:
    """Return the row in which the mean final angle of the last 50 episodes first exceeds `REGRASPING`, or None."""
    episodes = curve.columns.get("episodes", [WINDOW_FILL] * len(curve.columns[STEPS]))
    for index, (angle, count) in enumerate(zip(curve.columns[ANGLE], episodes, strict=True)):
        if count >= WINDOW_FILL and angle > REGRASPING:
            return index
    return None


RUN = re.compile(r"(?:(?P<setting>.+)-)?seed(?P<seed>\d+)$")
_FILTER_TIME = re.compile(r"task\.filter_time=(?P<time>[\d.]+)-(?P<task>task=\w+)$")


def read_sweep(folder: Path) -> dict[str, dict[int, Curve]]:
    """Read the runs of a multirun: setting -> seed -> learning curve.

    Args:
        folder: holds run folders `<setting>-seed<N>` or `seed<N>`, or copies of their metrics.csv named like them.

    Raises:
        InputError: there is no such run in the folder.
    """
    runs: dict[str, dict[int, Curve]] = {}
    for path in sorted(folder.glob("*seed*")):
        name = path.stem if path.suffix == ".csv" else path.name
        match = RUN.match(name)
        if match and (path.suffix == ".csv" or (path / "metrics.csv").is_file()):
            setting = _FILTER_TIME.sub(r"\g<task>, T_s \g<time> s", match["setting"] or folder.name)
            runs.setdefault(setting, {})[int(match["seed"])] = read_curve(path, name)
    if not runs:
        raise InputError(f"{folder}: no run <setting>-seed<N> with a metrics.csv; give the folder of a multirun")
    return runs


def sweep_table(runs: Mapping[str, Mapping[int, Curve]], paper: Mapping[str, str] | None = None) -> str:
    """Return the table of the runs, a line each setting; medians over the seeds with their `median_interval`.

    Args:
        runs: from `read_sweep`.
        paper: published column by setting; its settings are the lines then, those without a run as such.
    """
    head = ["setting", *(["paper, million steps"] if paper else []), "million steps, seed by seed", *MEDIANS]
    lines = [head, ["---"] * len(head)]
    for setting in paper or sorted(runs):
        begun, medians, steps = list[str](), [""] * len(MEDIANS), list[float]()
        curves = [curve for _, curve in sorted(runs.get(setting, {}).items())]
        for curve in curves:
            row, columns = regrasping_begins(curve), curve.columns
            steps.append(float("inf") if row is None else columns[STEPS][row] / 1e6)
            last = f"> {columns[STEPS][-1] / 1e6:.3f} (at {columns[ANGLE][-1]:.1f} rad)"
            begun.append(last if row is None else f"{steps[-1]:.3f}")
        if curves:
            hours = sum(curve.columns[name][-1] for curve in curves for name in COSTS if name in curve.columns)
            angles = [curve.columns[ANGLE][-1] for curve in curves]
            medians = [_interval(steps, 3), _interval(angles, 2), f"{hours:.3f}"]
        lines.append([setting, *([paper[setting]] if paper else []), ", ".join(begun) or "not run", *medians])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def median_interval(values: Sequence[float]) -> tuple[float, float, float]:
    """Return the median of some runs, and an interval that holds that of all runs with 95 % probability or more.

    Only ranks count: nothing is assumed of the distribution, and a run that never got there is infinite. For fewer than
    six runs the interval spans all of them; its probability is then 1 - 2^(1 - n), 75 % for three.

    Source: the sign test's interval; Conover, Practical Nonparametric Statistics, section 3.2.
    """
    ordered, n = sorted(values), len(values)
    outside = 0
    while 2 * sum(comb(n, k) for k in range(outside + 1)) <= 0.05 * 2**n:
        outside += 1
    first = max(outside - 1, 0)
    return median(ordered), ordered[first], ordered[n - 1 - first]


def _interval(values: Sequence[float], digits: int) -> str:
    middle, low, high = (f"{value:.{digits}f}".replace("inf", "never") for value in median_interval(values))
    return f"{middle} ({low} to {high})"
