"""How much of a jump of the command the sensors show at once, whatever effects lie between."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain import Plant
from tactile_cube.drivetrain.signals import COMMAND, MOTOR_POSITION, TORQUE

Array = NDArray[np.float64]
PROBE = 0.05  # [rad] beyond every dead zone, below the torque limits


def jump_ratio(plant: Plant, memory: Array, command: Array) -> tuple[Array, Array]:
    """Jump of the measured position [1] and of the torque [N m/rad] per jump of the command that acts, each (n,).

    Two steps of a copy, with and without a jump in the second one. An effect that holds the command back, such as a
    delay, does not let the probe pass; then the plain drive's ratio holds, for the jump comes later.

    Args:
        plant: the drivetrain.
        memory: (size,) the model at the start of a trial; left as it is.
        command: (n,) [rad].
    """
    seen = []
    for jump in (0.0, PROBE):
        copy = memory.copy()
        plant.kernel.step(command, copy)
        plant.kernel.step(command + jump, copy)
        seen.append([plant.signal(copy, row).copy() for row in (MOTOR_POSITION, TORQUE, COMMAND)])
    position, torque, acted = np.array(seen[1]) - np.array(seen[0])
    passed = np.abs(acted) > 0.5 * PROBE
    acted = np.where(passed, acted, 1.0)
    kp, compliance = plant.view(memory, "kp"), plant.view(memory, "compliance")
    plain = kp / (1.0 + kp * compliance)
    return np.where(passed, position / acted, plain * compliance), np.where(passed, torque / acted, plain)
