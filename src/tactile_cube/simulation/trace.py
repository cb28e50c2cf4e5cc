"""The signals of every physics step of one policy step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain import Plant
from tactile_cube.drivetrain.signals import COMMAND, MOTOR_POSITION, POSITION, TORQUE, VELOCITY

Array = NDArray[np.float64]

_JOINT_SIGNALS = {"q": POSITION, "dq": VELOCITY, "q_m": MOTOR_POSITION, "q_d": COMMAND, "torque": TORQUE}
_IN_SENSOR_TERMS = ("q_m", "q_d", "q_f")


def read_trace(
    plant: Plant, memory: Array, filtered: Array, offset: Array, states: Array, start: float
) -> dict[str, Array]:
    """Signals (substeps, ...) of the policy step that has just been run.

    Args:
        plant: The drivetrain.
        memory: Its memory after the step.
        filtered: q_f before the step (12,) [rad].
        offset: Joint offset (12,) [rad].
        states: State of the cube before each physics step, and after the last (substeps + 1, 13).
        start: Time of the first physics step [s].

    Returns:
        `time` [s]; `q`, `q_m`, `q_f`, `q_d` [rad], `dq` [rad/s] and `torque` [N m], each (substeps, 12);
        `cube_position` (substeps, 3) [m] and `cube_quaternion` (substeps, 4).
    """
    rows = plant.view(memory, "trace")
    trace: dict[str, Array] = {
        name: rows[:, :, row, :].reshape(len(rows), -1).copy() for name, row in _JOINT_SIGNALS.items()
    }
    trace["q_f"] = _filtered_targets(plant, memory, filtered, len(rows))
    for name in _IN_SENSOR_TERMS:
        trace[name] = trace[name] + offset
    trace["time"] = np.asarray(start + plant.dt * np.arange(len(rows), dtype=np.float64))
    trace["cube_position"], trace["cube_quaternion"] = states[:-1, :3], states[:-1, 3:7]
    return trace


def _filtered_targets(plant: Plant, memory: Array, filtered: Array, rows: int) -> Array:
    """q_f at each physics step (rows, 12): the low-pass in closed form, as its goal is constant in a policy step."""
    goal, time_constant = plant.view(memory, "goal"), float(plant.view(memory, "time_constant")[0])
    steps = np.arange(1, rows + 1)[:, None]
    remaining = np.exp(-steps * plant.dt / time_constant) if time_constant > 0.0 else np.zeros((rows, 1))
    return np.asarray(goal + remaining * (filtered - goal))
