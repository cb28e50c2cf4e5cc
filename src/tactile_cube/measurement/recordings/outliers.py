"""Single readings that are nonsense: found beside their neighbours, replaced, and left out of every error."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.recordings.columns import Columns

Array = NDArray[np.float64]
BEYOND = 5.0  # times the difference from its neighbours that 99 of 100 readings stay below; 13 sigma of white noise
MOST = 0.01  # share of the readings; more are no single ones
NEAR = 2  # rows on either side


def without_outliers(columns: Columns, joints: tuple[str, ...], path: Path) -> tuple[Columns, NDArray[np.bool_], list[str]]:
    """The columns with outlying positions bridged, which rows those are (n,), and a warning for each joint that has any.

    A reading is an outlier if it differs far more than usual both from the median of its neighbours and from the cubic
    through them: a step of the motion passes the first test, a quick turn the second.
    """
    position, rows, warnings = columns.position.copy(), np.zeros(len(columns.position), dtype=bool), []
    for j, joint in enumerate(joints):
        found, cubic = _outliers(position[:, j])
        if not len(found):
            continue
        worst = float(np.abs(position[found, j] - cubic[found]).max())
        warnings.append(
            f"{path}: column '{joint}.position': {len(found)} single readings differ from their neighbours by up to "
            f"{worst:.3g} (first in row {found[0]}: {position[found[0], j]:.4g}); they are bridged and counted in no error"
        )
        position[found, j], rows[found] = cubic[found], True
    return replace(columns, position=position), rows, warnings


def _outliers(values: Array) -> tuple[NDArray[np.int64], Array]:
    """Rows of outliers, and the cubic through the neighbours of each row, outliers among them left out."""
    median, cubic = _beside(values)
    limits = [BEYOND * np.quantile(np.abs(values - other), 0.99) for other in (median, cubic)]
    cleaned, found = values.copy(), np.zeros(len(values), dtype=bool)
    for _ in range(int(MOST * len(values)) + 1):
        median, cubic = _beside(cleaned)
        far = np.minimum(np.abs(cleaned - median) - limits[0], np.abs(cleaned - cubic) - limits[1])
        row = int(np.argmax(far))
        if far[row] <= 0.0 or 0.0 in limits:
            return np.flatnonzero(found), cleaned
        cleaned[row], found[row] = cubic[row], True
    return np.zeros(0, dtype=np.int64), values


def _beside(values: Array) -> tuple[Array, Array]:
    """Median of the five readings around each one, and the cubic through the other four."""
    padded = np.pad(values, NEAR, mode="reflect", reflect_type="odd")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEAR + 1)
    return np.median(around, axis=1), around @ (np.array([-1.0, 4.0, 0.0, 4.0, -1.0]) / 6.0)
