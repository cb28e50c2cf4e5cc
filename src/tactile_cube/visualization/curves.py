"""Learning curves of several runs, and the robustness map of a policy, as pictures."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactile_cube.errors import InputError
from tactile_cube.evaluation.evaluation import VariantResult
from tactile_cube.evaluation.verdict import REGRASP_ANGLE

ANGLE, STEPS = "final_angle", "steps"
CURRICULUM = ("T_s", "gravity")


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


def write_learning_curves(curves: Sequence[Curve], path: Path, title: str) -> None:
    """Draw mean final angle over environment steps, and below it what the curriculum did.

    Begin and end of the curriculum of the first run are marked by grey lines.

    Args:
        curves: the runs, e.g. one a seed.
        path: file to write; its ending (.png, .svg) chooses the format.
        title: of the picture.
    """
    figure = Figure(figsize=(8, 5), layout="constrained")
    angle, schedule = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    for curve in curves:
        million = [step / 1e6 for step in curve.columns[STEPS]]
        angle.plot(million, curve.columns[ANGLE], label=curve.label, linewidth=1.2)
    angle.axhline(REGRASP_ANGLE, color="grey", linestyle="--", linewidth=0.8)
    angle.annotate(
        "regrasping", (1, REGRASP_ANGLE), xycoords=("axes fraction", "data"), ha="right", va="bottom", size=8
    )
    angle.set(ylabel="mean final angle [rad]", title=title)
    angle.legend(fontsize=8)
    angle.grid(alpha=0.3)
    _draw_curriculum([angle, schedule], curves[0])
    schedule.set_xlabel("environment steps [million]")
    figure.savefig(path, dpi=110)


def _draw_curriculum(axes: Sequence[Axes], curve: Curve) -> None:
    million = [step / 1e6 for step in curve.columns[STEPS]]
    for name, label in zip(CURRICULUM, ("T_s [s]", "gravity"), strict=True):
        if name in curve.columns:
            axes[-1].plot(million, curve.columns[name], label=label, linewidth=1.2)
    for step in curriculum_ends(curve):
        for axis in axes:
            axis.axvline(step / 1e6, color="grey", linewidth=0.8)
    axes[-1].set_ylim(bottom=0)
    axes[-1].legend(fontsize=8)
    axes[-1].grid(alpha=0.3)


def curriculum_ends(curve: Curve) -> list[float]:
    """Return the steps at which the curriculum begins and ends, or nothing where it never moved."""
    values = curve.columns.get("gravity") or curve.columns.get("T_s") or []
    moving = [
        step for step, now, last in zip(curve.columns[STEPS][1:], values[1:], values, strict=False) if now != last
    ]
    return [moving[0], moving[-1]] if moving else []


def write_robustness_map(variants: Sequence[VariantResult], path: Path) -> None:
    """Draw mean final angle and success over each varied axis, the nominal condition as a grey line.

    Args:
        variants: results, the nominal one first; those with an `axis` are drawn.
        path: file to write.
    """
    nominal = variants[0].summary
    names = list(dict.fromkeys(variant.variant.axis for variant in variants if variant.variant.axis))
    columns = 3
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(10, 2.6 * rows), layout="constrained")
    axes = figure.subplots(rows, columns, sharey=True, squeeze=False).flat
    for axis, name in zip(axes, names, strict=False):
        points = sorted((v.variant.value, v.summary) for v in variants if v.variant.axis == name)
        values = [value for value, _ in points]
        axis.axhline(nominal.mean_angle, color="grey", linewidth=0.8)
        axis.errorbar(
            values, [s.mean_angle for _, s in points], [s.std_angle for _, s in points], marker="o", capsize=3
        )
        for value, summary in points:
            axis.annotate(f"{summary.kept}/{summary.episodes} kept", (value, 0), size=7, ha="center")
        axis.set(xlabel=name, ylim=(min(0.0, nominal.mean_angle), None))
        axis.grid(alpha=0.3)
    for axis in list(axes):
        axis.set_visible(False)
    figure.supylabel("mean final angle [rad]")
    figure.savefig(path, dpi=110)
