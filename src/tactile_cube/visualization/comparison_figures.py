"""Pictures of a comparison: measured over simulated, the band, the error by joint and regime."""

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.units import THOUSANDTHS
from tactile_cube.visualization.svg import ERROR, FLOOR, MEASURED, PALETTE, SIMULATED, Axes, Band, Line, line_chart
from tactile_cube.visualization.svg_tables import heat_map

Array = NDArray[np.float64]
MOST_KINDS = 6
BEFORE = PALETTE[1]


def overlay(comparison: Comparison, trial: int, joint: int, before: Comparison | None = None) -> str:
    """Command, measured and simulated angle of one joint in one trial, failing intervals marked.

    With `before`, the comparison of the model as it was, its simulation is drawn too.
    """
    one = comparison.recording.trials[trial]
    offset = _offset(comparison, trial, joint)
    lines = [Line("measured", one.time, _measured(comparison, trial, joint), MEASURED, 1.8)]
    if before is not None:
        was = before.simulated[trial].position[:, joint] + _offset(before, trial, joint)
        lines.append(Line("simulated before", one.time, was, BEFORE, 1.2, "6 3"))
    after = "simulated" if before is None else "simulated after"
    lines.append(Line(after, one.time, comparison.simulated[trial].position[:, joint] + offset, SIMULATED, 1.4))
    if not comparison.recording.torque_controlled:
        lines.insert(0, Line("command", one.time, one.command[:, joint], FLOOR, 1.0, "4 3"))
    name = comparison.recording.joints[joint]
    return line_chart(
        Axes("time [s]", f"{name} [{comparison.recording.units[name]}]", marked=marked(comparison, trial, joint)), lines
    )


def before_and_after(before: Comparison, after: Comparison, trial: int, joint: int) -> str:
    """What the model as it was, and with what was found, do not follow of one joint in one trial."""
    time = before.recording.trials[trial].time
    name = before.recording.joints[joint]
    lines = [
        Line("error before", time, 1e3 * before.residuals[trial][:, joint], BEFORE, 1.2),
        Line("error after", time, 1e3 * after.residuals[trial][:, joint], SIMULATED, 1.4),
    ]
    floor = 1e3 * 1.96 * after.floor.joints[name] * np.ones_like(time)
    band = [Band("noise floor (95 %)", time, -floor, floor, FLOOR)]
    return line_chart(Axes("time [s]", f"{name} [{small(before, joint)}]", height=200), lines, band)


def residual(comparison: Comparison, trial: int, joint: int) -> str:
    """Measured minus simulated of one joint in one trial, beside the noise floor."""
    time = comparison.recording.trials[trial].time
    name = comparison.recording.joints[joint]
    floor = 1e3 * 1.96 * comparison.floor.joints[name] * np.ones_like(time)
    line = Line("measured - simulated", time, 1e3 * comparison.residuals[trial][:, joint], ERROR, 1.2)
    band = [Band("noise floor (95 %)", time, -floor, floor, FLOOR)]
    axes = Axes("time [s]", f"{name} [{small(comparison, joint)}]", height=170, marked=marked(comparison, trial, joint))
    return line_chart(axes, [line], band)


def band(comparison: Comparison, trial: int, joint: int) -> str:
    """The measured angle of one joint among the randomised simulations, all as differences from the nominal one."""
    one, randomised = comparison.recording.trials[trial], comparison.band
    if randomised is None:
        return ""
    nominal = comparison.simulated[trial].position[:, joint]
    low, high = (1e3 * (edge[trial][:, joint] - nominal) for edge in (randomised.low, randomised.high))
    line = Line("measured", one.time, 1e3 * (_measured(comparison, trial, joint) - nominal), MEASURED, 1.2)
    axes = Axes("time [s]", f"{comparison.recording.joints[joint]} [{small(comparison, joint)}]", height=200)
    return line_chart(axes, [line], [Band("95 % of the simulations", one.time, low, high)])


def small(comparison: Comparison, joint: int) -> str:
    """The unit of a joint's errors, mrad or mm."""
    return THOUSANDTHS[comparison.recording.units[comparison.recording.joints[joint]]]


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


def _offset(comparison: Comparison, trial: int, joint: int) -> float:
    """The constant that was removed from the residual [rad]."""
    one = comparison.recording.trials[trial]
    difference = one.position - comparison.simulated[trial].position - comparison.residuals[trial]
    return float(np.nanmean(difference[:, joint]))
