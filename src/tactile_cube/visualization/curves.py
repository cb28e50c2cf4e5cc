"""Learning curves of several runs, and the robustness map of a policy, as pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactile_cube.evaluation.evaluation import VariantResult
from tactile_cube.evaluation.summary import Summary
from tactile_cube.evaluation.training_curve import ANGLE, REGRASPING, STEPS, Curve, curriculum_ends

CURRICULUM = ("T_s", "gravity")
MAP_COLUMNS = 3


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
    angle.axhline(REGRASPING, color="grey", linestyle="--", linewidth=0.8)
    angle.annotate("regrasping", (1, REGRASPING), xycoords=("axes fraction", "data"), ha="right", va="bottom", size=8)
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
