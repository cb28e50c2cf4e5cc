"""Does the measured torque hold the links up? If not, joints may be swapped, or masses or gravity be wrong."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial

Array = NDArray[np.float64]
SLOW = 0.1  # [rad/s] below which a torque holds weight and friction alone
MOST_SAMPLES = 200  # postures change slowly
FEWEST = 30
BETTER = 0.72  # a swap must leave less than this share of the missing torque
NEGLIGIBLE = 0.01  # [N m] of missing torque that friction explains


def swap_warning(recording: Recording) -> str | None:
    """A warning if the torques fit the weight of the links far better with two joints swapped, else None."""
    if recording.torque_controlled or len(recording.joints) < 2:
        return None
    still = [
        _still(trial, trial.torque) for trial in recording.trials if trial.torque is not None and not trial.is_bench
    ]
    position = np.concatenate([one[0] for one in still]) if still else np.zeros((0, len(recording.joints)))
    if len(position) < FEWEST:
        return None
    stride = max(1, len(position) // MOST_SAMPLES)
    position, torque = position[::stride], np.concatenate([one[1] for one in still])[::stride]
    tree = recording.rigid_body()
    as_named = _missing(tree, recording.gravity, position, torque)
    best, swap = as_named, None
    for pair in combinations(range(len(recording.joints)), 2):
        order = list(range(len(recording.joints)))
        order[pair[0]], order[pair[1]] = pair[1], pair[0]
        missing = _missing(tree, recording.gravity, position[:, order], torque[:, order])
        if missing < best:
            best, swap = missing, pair
    if swap is None or best > BETTER * as_named or as_named - best < NEGLIGIBLE:
        return None
    one, two = (recording.joints[index] for index in swap)
    return (
        f"{recording.folder}: columns '{one}.torque' and '{two}.torque' miss the weight of the links by "
        f"{as_named:.3f} N m, and by {best:.3f} N m with the two joints exchanged: are they swapped?"
    )


def _still(trial: Trial, torque: Array) -> tuple[Array, Array]:
    """Positions and torques (samples, joints) while every joint is slow."""
    slow = (np.abs(trial.velocity()) < SLOW).all(axis=1) & trial.valid
    return trial.position[slow], torque[slow]


def _missing(tree: RigidBodyTree, gravity: Array, position: Array, torque: Array) -> float:
    """RMS [N m] of measured torque minus the weight of the links."""
    still = np.zeros(tree.dofs)
    weight = np.stack([tree.coupling.T @ tree.equations(tree.expand(q), still, gravity)[1] for q in position])
    return float(np.sqrt(np.mean((torque - weight) ** 2)))
