"""Pictures of a comparison: measured over simulated, the band, the error by joint and regime."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.units import THOUSANDTHS
from tactile_cube.visualization.charts import (
    BEFORE,
    ERROR,
    FAILING,
    FLOOR,
    MEASURED,
    SIMULATED,
    heat_map,
    svg,
    time_chart,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
MOST_KINDS = 6
MOST_POINTS = 450  # of an area, whose outline Matplotlib does not simplify as it does curves


def overlay(comparison: Comparison, trial: int, joint: int, before: Comparison | None = None) -> str:
    """Command, measured and simulated angle of one joint in one trial, failing intervals marked.

    With `before`, the comparison of the model as it was, its simulation is drawn too.
    """
    one, name = comparison.recording.trials[trial], comparison.recording.joints[joint]
    axes = time_chart(f"{name} [{comparison.recording.units[name]}]")
    _shade(axes, comparison, trial, joint)
    if not comparison.recording.torque_controlled:
        axes.plot(one.time, one.command[:, joint], "--", color=FLOOR, linewidth=1.0, label="command")
    axes.plot(one.time, _measured(comparison, trial, joint), color=MEASURED, linewidth=1.8, label="measured")
    if before is not None:
        axes.plot(one.time, _simulated(before, trial, joint), "--", color=BEFORE, label="simulated before")
    after = "simulated" if before is None else "simulated after"
    axes.plot(one.time, _simulated(comparison, trial, joint), color=SIMULATED, linewidth=1.4, label=after)
    return svg(axes)


def residual(comparison: Comparison, trial: int, joint: int, before: Comparison | None = None) -> str:
    """Measured minus simulated of one joint in one trial beside the noise floor; with `before`, also of that model."""
    time = comparison.recording.trials[trial].time
    axes = _difference_chart(comparison, joint, 170 if before is None else 200)
    floor = 1e3 * 1.96 * comparison.floor.joints[comparison.recording.joints[joint]]
    axes.axhspan(-floor, floor, color=FLOOR, alpha=0.18, linewidth=0, label="noise floor (95 %)")
    errors = 1e3 * comparison.residuals[trial][:, joint]
    if before is None:
        _shade(axes, comparison, trial, joint)
        axes.plot(time, errors, color=ERROR, linewidth=1.2, label="measured - simulated")
    else:
        axes.plot(time, 1e3 * before.residuals[trial][:, joint], color=BEFORE, linewidth=1.2, label="error before")
        axes.plot(time, errors, color=SIMULATED, linewidth=1.4, label="error after")
    return svg(axes)


def band(comparison: Comparison, trial: int, joint: int) -> str:
    """The measured angle of one joint among the randomised simulations, all as differences from the nominal one."""
    time, randomised = comparison.recording.trials[trial].time, comparison.band
    if randomised is None:
        return ""
    nominal = comparison.simulated[trial].position[:, joint]
    low, high = (1e3 * (edge[trial][:, joint] - nominal) for edge in (randomised.low, randomised.high))
    axes = _difference_chart(comparison, joint, 200)
    few = slice(None, None, max(1, len(time) // MOST_POINTS))
    axes.fill_between(
        time[few], low[few], high[few], color=SIMULATED, alpha=0.25, linewidth=0, label="95 % of the simulations"
    )
    measured = 1e3 * (_measured(comparison, trial, joint) - nominal)
    axes.plot(time, measured, color=MEASURED, linewidth=1.2, label="measured")
    return svg(axes)


def _difference_chart(comparison: Comparison, joint: int, height: int) -> Axes:
    name = comparison.recording.joints[joint]
    return time_chart(f"{name} [{THOUSANDTHS[comparison.recording.units[name]]}]", height)


def _shade(axes: Axes, comparison: Comparison, trial: int, joint: int) -> None:
    for start, end in marked(comparison, trial, joint):
        axes.axvspan(start, end, color=FAILING, linewidth=0, zorder=0)


def regime_map(comparison: Comparison) -> str:
    """Error / noise floor of every joint in every regime; of many kinds of trial only the worst."""
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
    """The trial in which a joint's error is largest."""
    name = comparison.recording.joints[joint]
    return int(np.argmax([errors.joints[name] for errors in comparison.trials]))


def _measured(comparison: Comparison, trial: int, joint: int) -> Array:
    """The angles of a joint (n,), nan where a dropped sample was interpolated: nothing was measured there."""
    one = comparison.recording.trials[trial]
    return np.where(one.valid, one.position[:, joint], np.nan)


def _simulated(comparison: Comparison, trial: int, joint: int) -> Array:
    """The angles of a joint (n,) with the constant that was removed from the residual [rad]."""
    simulated = comparison.simulated[trial].position
    difference = comparison.recording.trials[trial].position - simulated - comparison.residuals[trial]
    return simulated[:, joint] + float(np.nanmean(difference[:, joint]))
