"""Trials without the intervals that follow no model, as when somebody pushes the arm."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import MINIMUM_SAMPLES
from tactile_cube.measurement.recordings.trial import Trial


def without_excluded(trial: Trial, intervals: Sequence[tuple[float, float]], key: str) -> list[Trial]:
    """What lies before, between and after the intervals, as trials that start at 0; shorter rests are dropped.

    Args:
        trial: on its uniform grid.
        intervals: start and end [s].
        key: what an error names.

    Raises:
        InputError: an interval that ends before it starts.
    """
    if not intervals:
        return [trial]
    kept = np.ones(len(trial.time), dtype=bool)
    for start, end in intervals:
        if end <= start:
            raise InputError(f"{key}: received [{start:g}, {end:g}]; expected start < end [s]")
        kept &= (trial.time < start) | (trial.time >= end)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], kept, [False]]).astype(int)))
    pieces = [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= MINIMUM_SAMPLES]
    return [_piece(trial, rows, f"{trial.name}_{number}") for number, rows in enumerate(pieces)]


def _piece(trial: Trial, rows: slice, name: str) -> Trial:
    return replace(
        trial,
        name=name,
        time=trial.time[rows] - trial.time[rows.start],
        command=trial.command[rows],
        position=trial.position[rows],
        torque=None if trial.torque is None else trial.torque[rows],
        valid=trial.valid[rows],
    )
