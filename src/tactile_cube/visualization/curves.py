"""Learning curves of runs, and the robustness map of a policy, as pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactile_cube.evaluation.evaluation import VariantResult
from tactile_cube.evaluation.training_curve import ANGLE, CURRICULUM, REGRASPING, STEPS, Curve
from tactile_cube.whole_file import write_whole

MAP_COLUMNS = 3


def write_learning_curves(curve: Curve, path: Path) -> None:
    """Draw mean final angle over environment steps, and below it what the curriculum did.

    Args:
        curve: the run.
        path: file to write; its ending (.png, .svg) chooses the format.
    """
    figure = Figure(figsize=(6.0, 6.0), layout="constrained")
    angle, schedule = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    million = np.divide(curve.columns[STEPS], 1e6)
    angle.plot(million, curve.columns[ANGLE], linewidth=1.2)
    for name, dashes in zip(CURRICULUM, ("-", ":"), strict=True):
        if name in curve.columns:
            schedule.plot(million, curve.columns[name], "C0", linestyle=dashes, linewidth=1.2)
    _mark_regrasping(angle)
    angle.set(title=curve.label)
    schedule.set(xlabel="environment steps [million]", ylabel="T_s [s] (solid),\ngravity (dotted)", ylim=(0, None))
    schedule.grid(alpha=0.3)
    _write(figure, path)


def write_sweep_curves(runs: Mapping[str, Mapping[int, Curve]], path: Path, title: str) -> None:
    """Draw the mean final angle over environment steps: a thin line each run, a thick one the median of a setting.

    Args:
        runs: setting -> seed -> learning curve; the median goes as far as the shortest of them.
        path: file to write; its ending (.png, .svg) chooses the format.
        title: of the picture.
    """
    figure = Figure(figsize=(8, 5), layout="constrained")
    axis = figure.subplots()
    for number, (setting, curves) in enumerate(sorted(runs.items())):
        color, every = f"C{number % 10}", list(curves.values())
        for curve in every:
            axis.plot(np.divide(curve.columns[STEPS], 1e6), curve.columns[ANGLE], color=color, linewidth=0.6, alpha=0.6)
        steps = np.linspace(0, min(curve.columns[STEPS][-1] for curve in every), 200)
        angles = [np.interp(steps, curve.columns[STEPS], curve.columns[ANGLE]) for curve in every]
        label = f"{setting} ({len(every)} {'run' if len(every) == 1 else 'runs'})"
        axis.plot(steps / 1e6, np.median(angles, axis=0), color=color, linewidth=2.0, label=label)
    _mark_regrasping(axis)
    axis.set(xlabel="environment steps [million]", title=title)
    figure.legend(loc="outside lower center", fontsize=7, ncols=1 if len(runs) < 5 else 2)
    _write(figure, path)


def _write(figure: Figure, path: Path) -> None:
    picture = BytesIO()
    figure.savefig(picture, format=path.suffix.removeprefix("."), dpi=110)
    write_whole(path, picture.getbuffer())


def _mark_regrasping(axis: Axes) -> None:
    axis.axhline(REGRASPING, color="grey", linestyle="--", linewidth=0.8)
    axis.annotate("regrasping", (0, REGRASPING), xycoords=("axes fraction", "data"), ha="left", va="bottom", size=8)
    axis.set_ylabel("mean final angle [rad]")
    axis.grid(alpha=0.3)


def write_robustness_map(variants: Sequence[VariantResult], nominal_values: Mapping[str, float], path: Path) -> None:
    """Draw the mean final angle over each varied axis, and beside each point how many episodes kept the cube.

    Args:
        variants: results, the nominal one first; those with an `axis` are drawn.
        nominal_values: where the nominal condition lies on each axis.
        path: file to write.
    """
    names = list(dict.fromkeys(one.variant.axis for one in variants if one.variant.axis))
    rows = -(-len(names) // MAP_COLUMNS)
    figure = Figure(figsize=(10, 2.6 * rows), layout="constrained")
    panels = list(figure.subplots(rows, MAP_COLUMNS, sharey=True, squeeze=False).flat)
    for panel, name in zip(panels, names, strict=False):
        points = [(one.variant.value, one.summary) for one in variants if one.variant.axis == name]
        if name in nominal_values:
            points.append((nominal_values[name], variants[0].summary))
            panel.axvline(nominal_values[name], color="grey", linewidth=0.8, linestyle="--")
        values, summaries = zip(*sorted(points, key=lambda point: point[0]), strict=True)
        means = [one.mean_angle for one in summaries]
        panel.errorbar(values, means, [one.std_angle for one in summaries], marker="o", capsize=3, linewidth=1.2)
        for value, one in points:
            label = f"{one.kept}/{one.episodes}"
            panel.annotate(label, (value, one.mean_angle), (4, 5), textcoords="offset points", size=7)
        panel.axhline(0.0, color="black", linewidth=0.6)
        panel.margins(x=0.15, y=0.2)
        panel.grid(alpha=0.3)
        panel.set_xlabel(name)
    for panel in panels[len(names) :]:
        panel.set_visible(False)
    figure.supylabel("mean final angle [rad]; label: episodes that kept the cube")
    _write(figure, path)
