"""Time stamps of a trial: in order, at the stated rate, and put on a uniform grid."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import TrialColumns

Array = NDArray[np.float64]
UNITS = {1e3: "milliseconds", 1e6: "microseconds", 1e9: "nanoseconds"}
DROPPED = 1.75  # periods between samples above which at least one is missing
LONGEST_GAP = 0.25  # [s] beyond this the command in between is anybody's guess
JITTER = 0.1  # share of a period that is worth a warning
TINY = 1e-12  # share of a period below which no rate fits
ON_GRID = 0.02  # share of a period below which samples are taken as they are
Signals = TypeVar("Signals")


def rows_of(signals: Signals, rows: slice | NDArray[np.bool_]) -> Signals:
    """Columns, a trial or a table to be written with these rows of its arrays alone."""
    arrays = {one.name: getattr(signals, one.name) for one in fields(signals)}  # type: ignore[arg-type]
    return replace(signals, **{name: a[rows] for name, a in arrays.items() if isinstance(a, np.ndarray)})  # type: ignore[type-var]


def check_time(columns: TrialColumns, rate: float, path: Path) -> tuple[TrialColumns, list[str]]:
    """Columns without repeated time stamps, and warnings about jitter and dropped samples.

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
    """Columns at uniform time steps from 0, and which samples are not bridged over a gap.

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
