"""Charts of the reports, and figures of a comparison: Matplotlib draws them as SVG text that needs nothing else."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tactile_cube.evaluation.training_curve import ANGLE, CURRICULUM, REGRASPING, STEPS, Curve
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.units import SMALL, shown
from tactile_cube.whole_file import write_whole

if TYPE_CHECKING:  # a report of a measurement waits for no learning library
    from tactile_cube.evaluation.evaluation import VariantResult

Array = NDArray[np.float64]

# Colours of Okabe and Ito, which the colour-blind tell apart, and lines of different lightness.
MEASURED, SIMULATED, BEFORE, ERROR = "#000000", "#0072b2", "#d55e00", "#d55e00"
FLOOR, FAILING, GRID = "#57606a", "#fdede6", "#eaeef2"
PALETTE = (SIMULATED, BEFORE, "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000", FLOOR)
WIDTH, ROW = 900, 26  # [px]
MOST_KINDS = 6
MOST_POINTS = 450  # of an area, whose outline Matplotlib does not simplify as it does curves
STYLE: Any = {
    "font.sans-serif": ["DejaVu Sans"], "font.size": 12, "svg.fonttype": "none", "svg.hashsalt": "tactile_cube",
    "path.simplify_threshold": 1.0, "axes.xmargin": 0, "axes.ymargin": 0.06, "axes.grid": True, "axes.axisbelow": True,
    "axes.edgecolor": "#d0d7de", "grid.color": GRID, "axes.labelcolor": FLOOR, "text.color": "#1b1f24",
    "xtick.color": FLOOR, "ytick.color": FLOOR, "xtick.major.size": 0, "ytick.major.size": 0, "legend.frameon": False,
}  # fmt: skip


@matplotlib.rc_context(STYLE)
def empty_chart(height: float, left: float = 62, right: float = 14, top: float = 26, bottom: float = 40) -> Axes:
    """Return the axes to draw in, with margins [px] of a picture that is `WIDTH` wide."""
    figure = Figure(figsize=(WIDTH / 72, height / 72))  # a point of 1/72 inch is a pixel of the page
    return figure.add_axes((left / WIDTH, bottom / height, 1 - (left + right) / WIDTH, 1 - (top + bottom) / height))


@matplotlib.rc_context(STYLE)
def time_chart(label: str, height: float = 240, x_label: str = "time [s]") -> Axes:
    """Return the axes for curves over one x axis, time by default."""
    axes = empty_chart(height)
    axes.set(xlabel=x_label, ylabel=label)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.locator_params("y", nbins=5)
    return axes


@matplotlib.rc_context(STYLE)
def svg(axes: Axes) -> str:
    """Return the SVG element of a chart, with a legend above it where something has a label."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0, borderpad=0.3, ncols=9)
    text = StringIO()
    about = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    axes.figure.savefig(text, format="svg", metadata=about)  # type: ignore[union-attr]
    # Groups are numbered in each figure anew: their ids would stand in a page several times.
    plain = re.sub(r' id="[\w.]+_\d+"', "", text.getvalue()[text.getvalue().index("<svg") :])
    return re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d)\d+|\s+(?=[LM\"])", r"\1", path[0]), plain)


@matplotlib.rc_context(STYLE)
def bar_chart(bars: Sequence[tuple[str, float]], unit: str, floor: float | None = None) -> str:
    """Draw horizontal bars with their numbers; a dashed line marks the noise floor."""
    axes = empty_chart(ROW * len(bars) + 34, left=230, right=110, top=4, bottom=30)
    names, values = [name for name, _ in bars], [value for _, value in bars]
    drawn = axes.barh(range(len(bars)), values, 0.7, color=SIMULATED)
    axes.bar_label(drawn, [f"{value:.3g} {unit}" for value in values], padding=6)
    axes.set(yticks=range(len(bars)), yticklabels=names, xticks=[], ylim=(len(bars) - 0.5, -0.5))
    axes.set_xlim(0, max([*values, floor or 0.0]) or 1.0)
    axes.spines[:].set_visible(False)
    axes.grid(False)
    if floor is not None:
        axes.axvline(floor, color=FLOOR, linestyle="--", clip_on=False)
        axes.set_xticks([floor], [f"noise floor {floor:.2g} {unit}"])
    return svg(axes)


@matplotlib.rc_context(STYLE)
def heat_map(rows: Sequence[str], columns: Sequence[str], values: Sequence[Sequence[float | None]]) -> str:
    """Draw ratios on a background that reddens with their logarithm, from 1 to the largest or 6; None stays empty."""
    width = min(74, (WIDTH - 180) / max(1, len(columns)))
    height = 150 + ROW * len(rows) + 8
    axes = empty_chart(height, left=90, right=WIDTH - 90 - width * len(columns), top=150, bottom=8)
    ratios = np.array(values, dtype=float)
    heat = np.log(np.maximum(ratios, 1.0)) / np.log(np.nanmax([6.0, *ratios.flat]))
    axes.pcolormesh(heat, cmap="Reds", vmin=0, vmax=1.25, edgecolors="white", linewidth=2)
    for (row, column), ratio in np.ndenumerate(ratios):
        color = "white" if heat[row, column] > 0.6 else "black"
        if not np.isnan(ratio):
            shown = f"{ratio:.1f}" if ratio < 99.5 else f"{ratio:.0f}"
            axes.text(column + 0.5, row + 0.5, shown, ha="center", va="center_baseline", color=color)
    axes.set_xticks(np.arange(len(columns)) + 0.5, columns, rotation=42, ha="left", rotation_mode="anchor")
    axes.set_yticks(np.arange(len(rows)) + 0.5, rows)
    axes.tick_params(top=True, labeltop=True, bottom=False, labelbottom=False, labelcolor="#1b1f24")
    axes.invert_yaxis()
    axes.spines[:].set_visible(False)
    axes.grid(False)
    return svg(axes)


@matplotlib.rc_context(STYLE)
def interval_chart(intervals: Sequence[tuple[str, float, float, float, str]]) -> str:
    """Draw one row per value, each on an axis of its own: the interval as a bar, the value as a dot.

    A row is given as name, value, low, high and unit.
    """
    axes = empty_chart(ROW * len(intervals) + 12, left=330, right=250, top=6, bottom=6)
    for row, (_, value, low, high, unit) in enumerate(intervals):
        least = min(low, high, value)
        width = (max(low, high, value) - least) or 1.0
        axes.hlines(row, (low - least) / width, (high - least) / width, color="#80b9d9", linewidth=7)
        axes.plot((value - least) / width, row, "o", color=SIMULATED)
        label = f"{value:.4g} {unit} [{low:.4g}, {high:.4g}]"
        axes.annotate(label, (1, row), (14, 0), axes.get_yaxis_transform(), textcoords="offset points", va="center")
    axes.set(yticks=range(len(intervals)), yticklabels=[name for name, *_ in intervals], xticks=[], xlim=(-0.08, 1.08))
    axes.set_ylim(len(intervals) - 0.5, -0.5)
    axes.tick_params(labelcolor="#1b1f24")
    axes.spines[:].set_visible(False)
    return svg(axes)


def overlay(comparison: Comparison, trial: int, joint: int, before: Comparison | None = None) -> str:
    """Draw command, measured and simulated angle of one joint in one trial, failing intervals marked.

    With `before`, the comparison of the model as it was, its simulation is drawn too.
    """
    one, name = comparison.recording.trials[trial], comparison.recording.joints[joint]
    unit = comparison.recording.shown[name]
    axes, size = time_chart(f"{name} [{unit}]"), shown("[rad]", unit)[1]
    _shade(axes, comparison, trial, joint)
    if not comparison.recording.torque_controlled:
        axes.plot(one.time, size * one.command[:, joint], "--", color=FLOOR, linewidth=1.0, label="command")
    axes.plot(one.time, size * _measured(comparison, trial, joint), color=MEASURED, linewidth=1.8, label="measured")
    if before is not None:
        axes.plot(one.time, size * _simulated(before, trial, joint), "--", color=BEFORE, label="simulated before")
    after = "simulated" if before is None else "simulated after"
    axes.plot(one.time, size * _simulated(comparison, trial, joint), color=SIMULATED, linewidth=1.4, label=after)
    return svg(axes)


def residual(comparison: Comparison, trial: int, joint: int, before: Comparison | None = None) -> str:
    """Draw measured minus simulated of a joint in a trial and the noise floor; with `before`, also of that model."""
    time = comparison.recording.trials[trial].time
    axes, size = _difference_chart(comparison, joint, 170 if before is None else 200)
    floor = size * 1.96 * comparison.floor.joints[comparison.recording.joints[joint]]
    axes.axhspan(-floor, floor, color=FLOOR, alpha=0.18, linewidth=0, label="noise floor (95 %)")
    errors = size * comparison.residuals[trial][:, joint]
    if before is None:
        _shade(axes, comparison, trial, joint)
        axes.plot(time, errors, color=ERROR, linewidth=1.2, label="measured - simulated")
    else:
        axes.plot(time, size * before.residuals[trial][:, joint], color=BEFORE, linewidth=1.2, label="error before")
        axes.plot(time, errors, color=SIMULATED, linewidth=1.4, label="error after")
    return svg(axes)


def band(comparison: Comparison, trial: int, joint: int) -> str:
    """Draw the measured angle of one joint among the randomised simulations, all relative to the nominal one."""
    time, randomised = comparison.recording.trials[trial].time, comparison.band
    if randomised is None:
        return ""
    nominal = comparison.simulated[trial].position[:, joint]
    axes, size = _difference_chart(comparison, joint, 200)
    low, high = (size * (edge[trial][:, joint] - nominal) for edge in (randomised.low, randomised.high))
    few = slice(None, None, max(1, len(time) // MOST_POINTS))
    axes.fill_between(
        time[few], low[few], high[few], color=SIMULATED, alpha=0.25, linewidth=0, label="95 % of the simulations"
    )
    measured = size * (_measured(comparison, trial, joint) - nominal)
    axes.plot(time, measured, color=MEASURED, linewidth=1.2, label="measured")
    return svg(axes)


def _difference_chart(comparison: Comparison, joint: int, height: int) -> tuple[Axes, float]:
    """Return the axes of a joint's errors, and how many of their unit make a rad or m."""
    name = comparison.recording.joints[joint]
    unit, size = SMALL[comparison.recording.shown[name]]
    return time_chart(f"{name} [{unit}]", height), size


def _shade(axes: Axes, comparison: Comparison, trial: int, joint: int) -> None:
    for start, end in marked(comparison, trial, joint):
        axes.axvspan(start, end, color=FAILING, linewidth=0, zorder=0)


def regime_map(comparison: Comparison) -> str:
    """Draw error / noise floor of every joint in every regime; of many kinds of trial only the worst."""
    worst_first = sorted((one for one in comparison.regimes if one.dimension == "kind"), key=lambda one: -one.error)
    kinds = list(dict.fromkeys(one.regime for one in worst_first))[:MOST_KINDS]
    names = list(dict.fromkeys((one.dimension, one.regime) for one in comparison.regimes))
    names = [(dimension, regime) for dimension, regime in names if dimension != "kind" or regime in kinds]
    cells = {(one.joint, one.dimension, one.regime): one.error for one in comparison.regimes}
    values: list[list[float | None]] = []
    for joint in comparison.recording.joints:
        floor = comparison.floor.joints[joint]
        errors = [cells.get((joint, *name)) for name in names]
        values.append([None if error is None else error / floor for error in errors])
    return heat_map(list(comparison.recording.joints), [regime for _, regime in names], values)


def marked(comparison: Comparison, trial: int, joint: int) -> tuple[tuple[float, float], ...]:
    """Start and end [s] of the failing intervals of one joint in one trial."""
    name, of = comparison.recording.joints[joint], comparison.recording.trials[trial].name
    return tuple((one.start, one.end) for one in comparison.failing_intervals if one.joint == name and one.trial == of)


def worst_trial(comparison: Comparison, joint: int) -> int:
    """Return the trial in which a joint's error is largest."""
    name = comparison.recording.joints[joint]
    return int(np.argmax([errors.joints[name] for errors in comparison.trials]))


def _measured(comparison: Comparison, trial: int, joint: int) -> Array:
    """Return the measured angles of a joint (n,), nan where a dropped sample was interpolated."""
    one = comparison.recording.trials[trial]
    return np.where(one.valid, one.position[:, joint], np.nan)


def _simulated(comparison: Comparison, trial: int, joint: int) -> Array:
    """Return the angles of a joint (n,) with the constant that was removed from the residual [rad]."""
    simulated = comparison.simulated[trial].position
    difference = comparison.recording.trials[trial].position - simulated - comparison.residuals[trial]
    return simulated[:, joint] + float(np.nanmean(difference[:, joint]))


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
    write_whole(path, picture.getvalue())


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
