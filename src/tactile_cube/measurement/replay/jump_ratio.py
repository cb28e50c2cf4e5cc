"""How much of a jump of the command the sensors show at once, whatever effects lie between."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain import Plant
from tactile_cube.drivetrain.effects.transmission import Backlash
from tactile_cube.drivetrain.signals import COMMAND, LEAD, LOOP_GAIN, MOTOR_POSITION, TORQUE
from tactile_cube.measurement.replay.windows import SAFE

Array = NDArray[np.float64]
SEEN = MOTOR_POSITION, TORQUE, COMMAND, LEAD, LOOP_GAIN
PROBE = 0.05  # [rad] beyond every dead zone
NOTHING = 1e-9  # part of the probe below which it is rounding that passes


def jump_ratio(plant: Plant, memory: Array, command: Array) -> tuple[Array, Array]:
    """Jump of the measured position [1] and of the torque [N m/rad] per jump of the command that acts, each (n,).

    What a motor follows freely within a gap is no part of either, see `free_way`.

    Two steps of a copy, with and without a jump in the second one. An effect that holds the command back, such as a
    delay, does not let the probe pass; then the plain drive's ratio holds, for the jump comes later.

    Args:
        plant: the drivetrain.
        memory: (size,) the model at the start of a trial; left as it is.
        command: (n,) [rad].
    """
    seen = []
    kp, compliance = plant.view(memory, "kp"), plant.view(memory, "compliance")
    probe = np.minimum(PROBE, SAFE * plant.view(memory, "torque_limit") / np.maximum(kp, np.finfo(float).tiny))
    for jump in (np.zeros_like(probe), probe):
        copy = memory.copy()
        plant.kernel.step(command, copy)
        plant.kernel.step(command + jump, copy)
        seen.append([plant.signal(copy, row).copy() for row in SEEN])
    position, torque, acted = np.array(seen[1][:3]) - np.array(seen[0][:3])
    passed = np.abs(acted) > 0.5 * probe
    free = free_way(plant, memory, acted, *seen[1][3:])
    passed &= np.abs(acted - free) > NOTHING * probe  # a gap wider than the probe lets nothing through
    position, acted = position - free, np.where(passed, acted - free, 1.0)
    plain = kp / (1.0 + kp * compliance)
    return np.where(passed, position / acted, plain * compliance), np.where(passed, torque / acted, plain)


def gaps(plant: Plant, memory: Array) -> Array:
    """Width of the gap that each joint's motor moves through freely (..., n) [rad]; 0 without one."""
    if Backlash not in plant.effects:
        return np.zeros(len(plant.joint_names))
    _, gap, smooth, _, crossing = np.moveaxis(plant.view(memory, "parameters:backlash"), -1, 0)
    return np.asarray(np.where(crossing <= 0.0, gap, 0.0) + smooth)


def free_way(plant: Plant, memory: Array, jump: Array, lead: Array, gain: Array) -> Array:
    """The part of a jump of the command that a motor makes freely, within the gap of a transmission.

    Args:
        plant: the drivetrain.
        memory: (..., size).
        jump: (..., n) of the command [rad].
        lead: (..., n) signal LEAD after the jump [rad].
        gain: (..., n) signal LOOP_GAIN [N m/rad].
    """
    if Backlash not in plant.effects:
        return np.zeros_like(jump)
    p = plant.view(memory, "parameters:backlash")
    return Backlash.free_lead(lead, p, gain) - Backlash.free_lead(lead - jump, p, gain)
