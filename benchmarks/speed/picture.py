"""The whole benchmark as one picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.layout_engine import ConstrainedLayoutEngine

from benchmarks.speed.report import Growth, Section

COLUMNS = 2
LABEL = 30
"""Letters a line of a bar's name."""
OURS, THEIRS = "#2b6cb0", "#a0aec0"


def write_picture(sections: Sequence[Section], path: Path) -> None:
    """Bars for each section and unit, with quartiles and ratios, and a curve for each growth.

    Args:
        sections: what was measured.
        path: file to write; its ending chooses the format.
    """
    bars = [(section, unit) for section in sections for unit in dict.fromkeys(f.unit for f in section.figures)]
    curves = [growth for section in sections for growth in section.growth]
    panels = len(bars) + len(curves)
    if panels == 0:
        return
    rows = -(-panels // COLUMNS)
    canvas = Canvas(figsize=(7.0 * COLUMNS, 2.6 * rows), layout=ConstrainedLayoutEngine(h_pad=0.12))
    axes = [axis for line in canvas.subplots(rows, COLUMNS, squeeze=False) for axis in line]
    for axis, (section, unit) in zip(axes, bars, strict=False):
        _draw_bars(axis, section, unit)
    for axis, growth in zip(axes[len(bars) :], curves, strict=False):
        _draw_curve(axis, growth)
    for axis in axes[panels:]:
        axis.set_visible(False)
    canvas.savefig(path, dpi=110)


def _draw_bars(axis: Axes, section: Section, unit: str) -> None:
    figures = [figure for figure in section.figures if figure.unit == unit][::-1]
    names, values = [fill(figure.name, LABEL) for figure in figures], [figure.value for figure in figures]
    spread = [[f.value - f.low for f in figures], [f.high - f.value for f in figures]]
    peers = {"PyBullet", "MuJoCo", "mujoco", "Stable"}
    colours = [THEIRS if any(name.startswith(peer) for peer in peers) else OURS for name in names]
    axis.barh(names, values, xerr=spread, color=colours, ecolor="black", capsize=2)
    for row, figure in enumerate(figures):
        if figure.ratio is not None:
            axis.annotate(f" {figure.ratio:.2f}x", (figure.high, row), va="center", fontsize=8)
    axis.set_title(f"{section.name} [{unit}]", fontsize=10)
    axis.tick_params(labelsize=8)
    axis.margins(x=0.15)


def _draw_curve(axis: Axes, growth: Growth) -> None:
    axis.plot(growth.x, growth.y, "o-", color=OURS)
    axis.set_title(growth.name, fontsize=10)
    axis.set(xlabel=growth.x_name, ylabel=growth.y_name)
    axis.set_ylim(bottom=0)
    if growth.x[-1] > 20 * growth.x[0]:
        axis.set_xscale("log")
    axis.grid(alpha=0.3)
