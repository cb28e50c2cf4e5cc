"""The columns of a trial's table: complete, in order, without outliers, on a uniform time grid."""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.tables import Table

Array = NDArray[np.float64]
MINIMUM_SAMPLES = 20
SIGNALS = ("command", "position", "torque", "link_position", "feedforward")
"""Signals of a joint; command and position are required."""
OF_SOME = {"link_position": np.nan, "feedforward": 0.0}
"""Signals that some joints may have, and what stands for those of the others."""


@dataclass(frozen=True)
class TrialColumns:
    """What was commanded and measured; `sensors.read` of the recording says when `position[k]` was read."""

    time: Array  # (n,) [s]
    command: Array  # (n, joints) desired position [rad] ([N m] where the controller's mode is `torque`)
    position: Array  # (n, joints) measured position, on the motor side [rad]
    torque: Array | None = None  # (n, joints) measured torque [N m]
    # (n, joints) measured on the link side [rad], nan where a joint has no sensor there; or None
    link_position: Array | None = None
    # (n, joints) torque that the controller added to its own [N m], acting like `command`; or None
    feedforward: Array | None = None


def pick_columns(table: Table, joints: tuple[str, ...], path: Path) -> tuple[TrialColumns, list[str]]:
    """Return the named columns of a table, and warnings about what is not used.

    Raises:
        InputError: a missing column, a trial with too few samples, or a value that is not a finite number.
    """
    others = {name.rpartition(".")[0] for name in table if name.rpartition(".")[2] in SIGNALS} - set(joints) - {""}
    unknown = "columns of '{}' are ignored: it is not among joints {}"
    warnings = [f"{path}: {unknown.format(joint, list(joints))}" for joint in sorted(others)]
    needed = ["time", *(f"{joint}.{signal}" for joint in joints for signal in SIGNALS[:2])]
    if missing := [name for name in needed if name not in table]:
        raise InputError(f"{path}: column '{missing[0]}' is missing (missing: {missing}; the file has: {list(table)})")
    samples = len(table["time"])
    if samples < MINIMUM_SAMPLES:
        raise InputError(
            f"{path}: column 'time' has {samples} samples, last row {samples - 1}; a trial needs at least "
            f"{MINIMUM_SAMPLES}: record it again or remove it from recording.yaml"
        )
    torques = [f"{joint}.torque" for joint in joints]
    lacking = [name for name in torques if name not in table or np.isnan(table[name]).all()]
    if 0 < len(lacking) < len(joints):
        warnings.append(f"{path}: column '{lacking[0]}' is missing or empty: torque is not used in this trial")
    signals: dict[str, Array] = {}
    for signal in SIGNALS:
        names = [f"{joint}.{signal}" for joint in joints]
        known = [name for name in names if name in table and name not in lacking]
        if len(known) == len(names) or (known and signal in OF_SOME):
            rest = np.full(samples, OF_SOME.get(signal, 0.0))
            signals[signal] = np.stack([_finite(table, n, path) if n in known else rest for n in names], axis=1)
    return TrialColumns(_finite(table, "time", path), **signals), warnings


def _finite(table: Table, name: str, path: Path) -> Array:
    wrong = np.flatnonzero(~(np.abs(table[name]) <= (np.finfo(float).max if name == "time" else limits.NUMBER)))
    if len(wrong):
        row = int(wrong[0])
        raise InputError(
            f"{path}: column '{name}', row {row}: received {table[name][row]} ({len(wrong)} such rows); "
            "leave out rows that were not measured, the time column then shows the gap"
        )
    return table[name]


BEYOND = {0.9: 8.0, 0.99: 5.0}
"""Quantile -> times the difference from the neighbours there; both are 13 sigma of white noise.

Neighbours of outliers differ too, which the first quantile leaves out; it is zero where a coarse encoder rests.
"""
SPIKE = 0.5  # of the difference from the cubic that a spike differs from the median too
MOST, MANY = 0.01, 1000  # share and number of the readings; more are no single ones, and looking for them takes hours
NEAR = 2  # rows on either side


def without_outliers(
    columns: TrialColumns, joints: tuple[str, ...], path: Path
) -> tuple[TrialColumns, NDArray[np.bool_], list[str]]:
    """Return the columns with outlying positions bridged, the mask of their rows (n,), and a warning per joint.

    A reading is an outlier if it differs far more than usual from the cubic through its neighbours, and by half of that
    at least from their median: a quick turn of the motion is near the cubic, a step of it near the median.
    """
    position, rows, warnings = columns.position.copy(), np.zeros(len(columns.position), dtype=bool), []
    for j, joint in enumerate(joints):
        found, cleaned = _outliers(position[:, j])
        if not len(found):
            continue
        worst = float(np.abs(position[found, j] - cleaned[found]).max())
        warnings.append(
            f"{path}: column '{joint}.position': {len(found)} single readings differ from their neighbours by up to "
            f"{worst:.3g} (first in row {found[0]}: {position[found[0], j]:.4g}); "
            "they are bridged, and errors leave them out"
        )
        position[found, j], rows[found] = cleaned[found], True
    return replace(columns, position=position), rows, warnings


def _outliers(values: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the rows of outliers, and the values with outliers replaced by the cubic through their neighbours."""
    differences = np.abs(values - _beside(values)[1])
    bounds = (times * float(np.quantile(differences, quantile)) for quantile, times in BEYOND.items())
    limit = next((bound for bound in bounds if bound > 0.0), 0.0)
    cleaned, far, found = values.copy(), _far(values), set[int]()
    while limit > 0.0 and len(found) <= min(MOST * len(values), MANY):
        row = int(np.argmax(far))
        if far[row] <= limit:
            return np.array(sorted(found), dtype=np.int64), cleaned
        first, end = max(0, row - 2 * NEAR), row + 2 * NEAR + 1
        cleaned[row] = _beside(cleaned[first:end])[1][row - first]
        changed = slice(max(0, row - NEAR), row + NEAR + 1)
        far[changed] = _far(cleaned[first:end])[changed.start - first : changed.stop - first]
        found.add(row)
    return np.zeros(0, dtype=np.int64), values


def _far(values: Array) -> Array:
    """Return the difference of each reading from the cubic, 0 where it is near the median."""
    median, cubic = _beside(values)
    far = np.abs(values - cubic)
    far[np.abs(values - median) < SPIKE * far] = 0.0
    return far


def _beside(values: Array) -> tuple[Array, Array]:
    """Return the median of the five readings around each one, and the cubic through the other four."""
    padded = np.pad(values, NEAR, mode="reflect", reflect_type="odd")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEAR + 1)
    return np.median(around, axis=1), around @ (np.array([-1.0, 4.0, 0.0, 4.0, -1.0]) / 6.0)


UNITS = {1e3: "milliseconds", 1e6: "microseconds", 1e9: "nanoseconds"}
DROPPED = 1.75  # periods between samples above which at least one is missing
LONGEST_GAP = 0.25  # [s] beyond this the command in between is unknown
JITTER = 0.1  # share of a period that is worth a warning
TINY = 1e-12  # share of a period below which no rate fits
ON_GRID = 0.02  # share of a period below which samples are taken as they are
Rows = TypeVar("Rows")


def rows_of(signals: Rows, rows: slice | NDArray[np.bool_]) -> Rows:
    """Return the columns, a trial or a table to be written with these rows of its arrays alone."""
    arrays = {one.name: getattr(signals, one.name) for one in fields(signals)}  # type: ignore[arg-type]
    return replace(signals, **{name: a[rows] for name, a in arrays.items() if isinstance(a, np.ndarray)})  # type: ignore[type-var]


def check_time(columns: TrialColumns, rate: float, path: Path) -> tuple[TrialColumns, list[str]]:
    """Return the columns without repeated time stamps, and warnings about jitter and dropped samples.

    Raises:
        InputError: time runs backwards, the rate is not the stated one, or a gap is too long to bridge.
    """
    columns, warnings = _without_repeats(columns, path)
    gaps = np.diff(columns.time) * rate
    _require_rate(gaps, rate, path)
    if np.median(gaps) / rate > LONGEST_GAP:
        raise InputError(
            f"{path}: column 'time', row 1: steps of {np.median(gaps) / rate:.3g} s show nothing of a drive; is "
            "the time in another unit (record source=csv source.time_unit=ms)?"
        )
    worst = int(np.argmax(gaps))
    if gaps[worst] / rate > LONGEST_GAP:
        raise InputError(
            f"{path}: column 'time', row {worst + 1}: {gaps[worst] / rate:.3f} s after the row before "
            f"({columns.time[worst]:.4f} s); split the trial there"
        )
    dropped = int(np.sum(np.round(gaps[gaps > DROPPED]) - 1))
    if dropped > len(columns.time):
        raise InputError(
            f"{path}: column 'time': of {dropped + len(columns.time)} samples at rate_hz {rate:g} it has "
            f"{len(columns.time)}; set rate_hz to what the log has, or split the trial"
        )
    if dropped:
        warnings.append(
            f"{path}: column 'time': {dropped} samples dropped (longest gap {gaps[worst] / rate * 1e3:.1f} ms "
            f"before row {worst + 1}); they are bridged and counted in no error"
        )
    jitter = np.abs(gaps[gaps <= DROPPED] - 1)
    if jitter.size and np.percentile(jitter, 95) > JITTER:
        row = int(np.argmax(np.where(gaps <= DROPPED, np.abs(gaps - 1), 0))) + 1
        warnings.append(
            f"{path}: column 'time': steps jitter by up to {jitter.max() / rate * 1e3:.2f} ms (row {row}) around "
            f"{1e3 / rate:.2f} ms; resampled to {rate:g} Hz"
        )
    return columns, warnings


def _without_repeats(columns: TrialColumns, path: Path) -> tuple[TrialColumns, list[str]]:
    steps = np.diff(columns.time)
    if (steps < 0).any():
        row = int(np.argmax(steps < 0)) + 1
        raise InputError(
            f"{path}: column 'time', row {row}: time runs backwards, from {columns.time[row - 1]:.6g} s to "
            f"{columns.time[row]:.6g} s; sort the rows or split the trial"
        )
    keep = np.concatenate([[True], steps > 0])
    if keep.all():
        return columns, []
    row, shorter = int(np.argmin(keep)), rows_of(columns, keep)
    if len(shorter.time) < 2:
        raise InputError(f"{path}: column 'time', row {row}: all rows have the same time {columns.time[0]:.6g} s")
    return shorter, [
        f"{path}: column 'time', row {row}: {int((~keep).sum())} repeated time stamps, the first of each is kept"
    ]


def _require_rate(gaps: Array, rate: float, path: Path) -> None:
    typical = float(np.median(gaps))
    if 0.75 < typical < 1.35:
        return
    remedy = f"set rate_hz to {rate / typical:.4g}" if typical > TINY else "time is in seconds"
    for factor, unit in UNITS.items():
        if 0.75 < typical / factor < 1.35:
            remedy = f"this looks like {unit}; time is in seconds"
    raise InputError(
        f"{path}: column 'time', row 1: steps of {typical / rate * 1e3:.3g} ms, but rate_hz {rate:g} in recording.yaml "
        f"means {1e3 / rate:.3g} ms; {remedy}"
    )


def on_grid(columns: TrialColumns, rate: float) -> tuple[TrialColumns, NDArray[np.bool_]]:
    """Return the columns at uniform time steps from 0, and which samples are not bridged over a gap.

    Positions and torques are interpolated; a command is held until the next one, as a controller does.
    """
    time = columns.time - columns.time[0]
    grid = np.arange(int(np.floor(time[-1] * rate + 0.5)) + 1) / rate
    if len(grid) == len(time) and np.max(np.abs(time - grid)) * rate < ON_GRID:
        return replace(columns, time=grid), np.ones(len(grid), dtype=bool)
    grid = grid[grid <= time[-1] + ON_GRID / rate]
    after = np.clip(np.searchsorted(time, grid, side="left"), 1, len(time) - 1)
    valid = (time[after] - time[after - 1]) * rate <= DROPPED
    valid |= np.minimum(np.abs(grid - time[after]), np.abs(grid - time[after - 1])) * rate < ON_GRID
    held = np.searchsorted(time, grid + ON_GRID / rate, side="right") - 1

    def interpolated(values: Array | None) -> Any:
        return None if values is None else np.stack([np.interp(grid, time, column) for column in values.T], axis=1)

    position, torque, links = (interpolated(x) for x in (columns.position, columns.torque, columns.link_position))
    feedforward = None if columns.feedforward is None else columns.feedforward[held]
    return TrialColumns(grid, columns.command[held], position, torque, links, feedforward), valid
