"""How long a model can be simulated before a small error has grown so much that it says nothing about the model."""

from __future__ import annotations

import numpy as np

from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.windows import Windows

GROWN = 3.0  # squared, an order of magnitude: from there on few unstable segments outweigh all stable ones
MOSTLY = 0.9  # quantile over the segments: one that tips over is no reason to cut all of them
FEWEST_ROWS = 8  # that a segment keeps, for its start is unknown too


def steady_rows(shooting: Shooting, model: Model, windows: Windows) -> int:
    """Rows of a segment within which an error of its start does not grow more than `GROWN` times.

    A pendulum about its upper rest makes a hundred out of one within a second, and no fit is judged by what is left.
    The model tells its own growth: the derivative of each joint's position by its position at the segment's start.

    Args:
        shooting: simulates.
        model: known beforehand; nothing is fitted yet.
        windows: with segments as long as identification likes them.

    Returns:
        Rows, those of the segments that there are where nothing grows.
    """
    joints = len(shooting.recording.joints)
    slopes = shooting.start_sensitivity(model, windows)[:joints]
    own = np.stack([np.abs(slopes[j, :, :, j]) for j in range(joints)], axis=-1)
    measured = (windows.weight > 0.0).any(axis=-1).reshape(-1, windows.segment)
    growth = np.where(measured, own.max(axis=-1).reshape(-1, windows.segment), np.nan)
    known = np.isfinite(growth).any(axis=0)
    mostly = np.zeros(windows.segment)
    mostly[known] = np.nanquantile(growth[:, known], MOSTLY, axis=0)
    grown = np.flatnonzero(mostly > GROWN)
    return max(int(grown[0]), min(FEWEST_ROWS, windows.segment)) if len(grown) else windows.segment
