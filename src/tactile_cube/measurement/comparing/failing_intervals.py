"""Intervals of a trial where the model fails: their start, end and size."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
WINDOW = 0.2  # [s] over which the error is averaged
FAILING = 3.0  # error / noise floor
SHORTEST = 0.1  # [s]


@dataclass(frozen=True)
class FailingInterval:
    """An interval from `start` to `end` [s] of one trial in which a joint's RMS error [rad] is far above the floor."""

    trial: str
    joint: str
    start: float
    end: float
    error: float


def failing_intervals(trial: str, joint: str, time: Array, residual: Array, floor: float) -> list[FailingInterval]:
    """Intervals where the RMS over 0.2 s exceeds three noise floors; `residual` (n,) [rad], nan where bridged."""
    step = float(time[1] - time[0])
    squares = np.nan_to_num(residual) ** 2
    window = max(1, round(WINDOW / step))
    rms = np.sqrt(np.convolve(squares, np.ones(window) / window, mode="same"))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (rms > FAILING * floor).astype(int), [0]])))
    return [
        FailingInterval(trial, joint, float(time[a]), float(time[b - 1]), float(np.sqrt(squares[a:b].mean())))
        for a, b in zip(edges[::2], edges[1::2], strict=True)
        if (b - a) * step >= SHORTEST
    ]
