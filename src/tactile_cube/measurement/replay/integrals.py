"""Integrals of a controller where a window begins: they have grown by errors that are logged, whatever a model says."""

import numpy as np
from numpy.typing import NDArray

from tactile_cube.compiled import compiled_once
from tactile_cube.drivetrain import Plant
from tactile_cube.drivetrain.effects.command import IntegralAction
from tactile_cube.drivetrain.signals import TORQUE
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.windows import Windows

Array = NDArray[np.float64]


def integrating_joints(model: Model, joints: tuple[str, ...]) -> list[int]:
    """Joints whose controller integrates its error in a model."""
    return [joints.index(t.joint) for t in model.terms if t.effect is IntegralAction and t.values["ki"] > 0.0]


def wind_up(plant: Plant, model: Model, windows: Windows, memory: Array) -> None:
    """Give integrals in memory (S, size) the value that they have as each window begins.

    As a trial begins they balance the load, but for the `wound` of its windows; from there on the logged error counts.
    """
    joints = integrating_joints(model, plant.joint_names)
    if not joints:
        return
    count, later = len(windows), windows.time > 0.0
    state = plant.view(memory, f"state:{IntegralAction.name}")
    state[:, joints, 1] = windows.wound[:, joints]
    if not later.any():
        return
    position, command, speed = np.moveaxis(windows.trial_start[:, :, None], 1, 0).copy()
    begun, unmoved = memory.copy(), np.zeros((count, 2 * position.shape[2]))
    plant.reset(begun, position[:, 0], speed[:, 0])
    which, lengths, starts = np.arange(count), np.ones(count, dtype=np.int64), (position, speed, unmoved, unmoved)
    out, no_path = np.zeros((count, 1, 1, position.shape[2])), np.zeros((count, 1))
    rows = np.array([TORQUE])
    plant.kernel.segments_batch(command, which, lengths, 0, 1, 1, *starts, begun, no_path, rows, 0, count, out)
    balance = plant.view(begun, f"state:{IntegralAction.name}")[:, :, 1]
    values = {t.joint: t.values for t in model.terms if t.effect is IntegralAction}
    for j in joints:
        own = values[plant.joint_names[j]]
        for k in np.flatnonzero(later):
            start = balance[k, j] + windows.wound[k, j]
            errors = windows.errors[k][:, 0, j] - own.get("lag", 0.0) * windows.errors[k][:, 1, j]
            state[k, j, 1] = integrated(errors, start, own["ki"], own.get("limit", 0.0))
        state[later, j, 0] = 2.0


@compiled_once
def integrated(errors: Array, start: float, gain: float, limit: float) -> float:
    """Integral [N m] after errors (T,) [rad s], kept within a limit unless that is zero."""
    value = start
    for error in errors:
        value += gain * error
        if limit > 0.0:
            value = min(max(value, -limit), limit)
    return value
