"""Learning curves of several runs, and the robustness map of a policy, as pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactile_cube.evaluation.evaluation import VariantResult
from tactile_cube.evaluation.summary import Summary
from tactile_cube.evaluation.training_curve import ANGLE, CURRICULUM, REGRASPING, STEPS, Curve, curriculum_ends

DASHES = ("-", ":")
MARKERS = (">", "s")
MAP_COLUMNS = 3


def write_learning_curves(
    curves: Sequence[Curve], path: Path, title: str, size: tuple[float, float] = (8.0, 5.5)
) -> None:
    """Draw mean final angle over environment steps, and below it what the curriculum did.

    A triangle and a square mark where the curriculum of a run begins and ends.

    Args:
        curves: the runs, e.g. one a seed.
        path: file to write; its ending (.png, .svg) chooses the format.
        title: of the picture.
        size: of the picture [inch].
    """
    figure = Figure(figsize=size, layout="constrained")
    angle, schedule = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    for number, curve in enumerate(curves):
        million = [step / 1e6 for step in curve.columns[STEPS]]
        style: dict[str, Any] = {"color": f"C{number % 10}", "linewidth": 1.2}
        angle.plot(million, curve.columns[ANGLE], label=curve.label, **style)
        for row, marker in zip(curriculum_ends(curve), MARKERS, strict=False):
            angle.plot(million[row], curve.columns[ANGLE][row], marker=marker, markeredgecolor="black", **style)
        for name, dashes in zip(CURRICULUM, DASHES, strict=True):
            if name in curve.columns:
                schedule.plot(million, curve.columns[name], linestyle=dashes, **style)
    angle.axhline(REGRASPING, color="grey", linestyle="--", linewidth=0.8)
    angle.annotate("regrasping", (0, REGRASPING), xycoords=("axes fraction", "data"), ha="left", va="bottom", size=8)
    angle.set(ylabel="mean final angle [rad]", title=title)
    angle.legend(fontsize=8)
    schedule.set(xlabel="environment steps [million]", ylabel="T_s [s] (solid),\ngravity (dotted)", ylim=(0, None))
    for axis in (angle, schedule):
        axis.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


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
    axis.axhline(REGRASPING, color="grey", linestyle="--", linewidth=0.8)
    axis.annotate("regrasping", (0, REGRASPING), xycoords=("axes fraction", "data"), ha="left", va="bottom", size=8)
    axis.set(xlabel="environment steps [million]", ylabel="mean final angle [rad]", title=title)
    axis.grid(alpha=0.3)
    figure.legend(loc="outside lower center", fontsize=7, ncols=1 if len(runs) < 5 else 2)
    figure.savefig(path, dpi=110)


def write_robustness_map(variants: Sequence[VariantResult], nominal_values: Mapping[str, float], path: Path) -> None:
    """Draw the mean final angle over each varied axis, and beside each point how many episodes kept the cube.

    Args:
        variants: results, the nominal one first; those with an `axis` are drawn.
        nominal_values: where the nominal condition lies on each axis.
        path: file to write.
    """
    names = list(dict.fromkeys(variant.variant.axis for variant in variants if variant.variant.axis))
    rows = -(-len(names) // MAP_COLUMNS)
    figure = Figure(figsize=(10, 2.6 * rows), layout="constrained")
    panels = list(figure.subplots(rows, MAP_COLUMNS, sharey=True, squeeze=False).flat)
    for panel, name in zip(panels, names, strict=False):
        points = [(variant.variant.value, variant.summary) for variant in variants if variant.variant.axis == name]
        if name in nominal_values:
            points.append((nominal_values[name], variants[0].summary))
            panel.axvline(nominal_values[name], color="grey", linewidth=0.8, linestyle="--")
        _draw_panel(panel, sorted(points, key=lambda point: point[0]))
        panel.set_xlabel(name)
    for panel in panels[len(names) :]:
        panel.set_visible(False)
    figure.supylabel("mean final angle [rad]; label: episodes that kept the cube")
    figure.savefig(path, dpi=110)


def _draw_panel(panel: Axes, points: Sequence[tuple[float, Summary]]) -> None:
    values = [value for value, _ in points]
    means, spreads = [s.mean_angle for _, s in points], [s.std_angle for _, s in points]
    panel.errorbar(values, means, spreads, marker="o", capsize=3, linewidth=1.2)
    panel.axhline(0.0, color="black", linewidth=0.6)
    panel.margins(x=0.15, y=0.2)
    panel.grid(alpha=0.3)
    for value, summary in points:
        label = f"{summary.kept}/{summary.episodes}"
        panel.annotate(label, (value, summary.mean_angle), (4, 5), textcoords="offset points", size=7)
