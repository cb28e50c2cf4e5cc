"""The torque that a model lacks, over the signal of a candidate: averaged in windows that hide the encoder's steps."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.resolution import NORMAL_95
from tactile_cube.identification.search.residual_shape import MANY, PARABOLA, Missing, missing_torques, shapes
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model

Array = NDArray[np.float64]
VISIBLE = 0.05  # noise of the missing torque over the usual torque of the drive: a law of less is not seen by eye
BINS = 16
FEWEST = 3  # segments in a bin, from which on their scatter is known


def missing_torque(
    problem: Problem, recording: Recording, model: Model, residual: Array, joint: str, noise: float
) -> Missing:
    """Return the torque that a joint would have to get so that a residual vanished; `noise` is its sensor's [rad].

    The residual is differentiated twice in windows so long that the noise stays below `VISIBLE` of the drive's torque:
    the curvature of a least-squares parabola through L samples h apart has the variance 720 noise^2 / (L^5 h^4).
    """
    size, step = problem.shooting.sizes[joint], recording.step
    variance = 720.0 * (size.inertia * noise / (VISIBLE * size.torque)) ** 2 / step**4
    time = max(PARABOLA * problem.shooting.time, 0.5 * step * variance**0.2)
    return missing_torques(problem, recording, model, residual, time)[recording.joints.index(joint)]


def signals(missing: Missing) -> list[str]:
    """Return the signals of a torque, the one that explains most of it first; a candidate's is a law of that one."""
    return list(dict.fromkeys(one.against.partition(", moving")[0] for one in shapes(missing)))


class Curve(NamedTuple):
    """The mean of a missing torque over bins of a signal; nan parts motion up from motion down."""

    x: Array  # (bins,) mean of the signal in each
    mean: Array  # [N m]
    low: Array  # of its 95 % interval, segments being independent
    high: Array


def curve(missing: Missing, signal: str) -> Curve:
    """Return the mean over a signal, for either direction of motion; over velocity and time for both."""
    values, moving = missing.signals[signal], missing.signals[f"velocity of {missing.joint} [rad/s]"]
    parts = [moving > 0.0, moving <= 0.0]
    if signal.startswith(("velocity", "time")) or min(int(part.sum()) for part in parts) < MANY:
        parts = [np.ones(len(values), dtype=bool)]
    gap = np.full((4, 1), np.nan)
    rows = [_means(values[part], missing.torque[part], missing.segment[part]) for part in parts if part.any()]
    return Curve(*np.concatenate([piece for row in rows for piece in (row, gap)], axis=1))


def _means(values: Array, torque: Array, segment: NDArray[np.int64]) -> Array:
    """Return signal, mean, low and high (4, bins): the mean of segments' means, each as it has samples in the bin."""
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, max(len(edges) - 2, 0))
    pair, index = np.unique(np.stack([place, segment]), axis=1, return_inverse=True)
    count = np.bincount(index)
    means = np.bincount(index, torque) / count
    rows = []
    for k in np.unique(place):
        here = pair[0] == k
        weight = count[here] / count[here].sum()
        mean = float(weight @ means[here])
        scatter = np.sqrt(np.sum(weight**2 * (means[here] - mean) ** 2)) if here.sum() >= FEWEST else np.nan
        rows.append((values[place == k].mean(), mean, mean - NORMAL_95 * scatter, mean + NORMAL_95 * scatter))
    return np.array(rows).T
