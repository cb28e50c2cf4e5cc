"""What a log shows of a simulation: the state at an instant, under the command of the period that ends or begins."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def impulses(command: Array, substeps: int) -> Array:
    """Commands (T, n) held from row to row, as the simulation's steps take them, (T * substeps, n).

    A step acts on the speeds like an impulse at its beginning; a held command acts from there on, half a step later.
    The mean of the commands before and after the instant makes the simulation second order in its step.
    """
    fine = np.repeat(command, substeps, axis=0)
    fine[substeps::substeps] = 0.5 * (command[:-1] + command[1:])
    return fine


def half_jumps(acting: Array, substeps: int) -> Array:
    """Half of the command's change (T, n) at the beginning of each row, from what acted in each step (T * substeps, n).

    With one step a row only the mean of two neighbouring changes is known.
    """
    jumps = np.zeros_like(acting)
    jumps[1:] = np.diff(acting, axis=0) * (1.0 if substeps > 1 else 0.5)
    return np.asarray(jumps[::substeps])


def free_way(lead: Array, jump: Array, gap: Array) -> Array:
    """The part of a jump of the command that a motor makes freely, within the gap of a transmission.

    Args:
        lead: (..., joints) signal LEAD after the jump [rad].
        jump: (..., joints) of the command [rad].
        gap: (joints,) widths, 0 without a gap [rad].
    """
    half = 0.5 * gap
    return np.asarray(np.clip(lead, -half, half) - np.clip(lead - jump, -half, half))


def read_out(
    position: Array,
    torque: Array,
    jump: Array,
    ratios: tuple[Array, Array],
    torque_limit: Array,
    free: Array | float = 0.0,
) -> tuple[Array, Array]:
    """Position [rad] and torque [N m] under the command that a log's instant feels.

    Args:
        position: (T, joints) simulated motor positions at the instants of reading [rad].
        torque: (T, joints) [N m].
        jump: (T, joints) the simulated command less the one that the log feels [rad].
        ratios: (joints,) jump of position [1] and of torque [N m/rad] per jump of the command, see `jump_ratio`.
        torque_limit: (joints,) [N m]; a torque at its limit does not jump.
        free: (T, joints) the part of the jump that the motor follows without torque [rad], see `free_way`.

    Returns:
        position and torque, (T, joints): without the jump in torque and in the drive's deflection.
    """
    felt = np.where(np.abs(torque) < 0.999 * torque_limit, jump - free, 0.0)
    return position - free - ratios[0] * felt, torque - ratios[1] * felt
