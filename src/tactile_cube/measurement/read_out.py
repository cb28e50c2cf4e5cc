"""What a log shows of a simulation: the state after the control period, with that period's command still acting."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def read_out(
    position: Array, torque: Array, command: Array, kp: Array, stiffness: Array, torque_limit: Array
) -> tuple[Array, Array]:
    """Position [rad] and torque [N m] at the end of each control period, from the signals at its beginnings.

    At the end of period k the links are where period k + 1 finds them, but the drive still feels command k: the jump
    from command k to k + 1 is taken out of torque and elastic deflection, except where the torque is at its limit.

    Args:
        position: (..., T + 1, joints) motor positions at the beginning of each period [rad].
        torque: (..., T + 1, joints) [N m].
        command: (..., T + 1, joints) the command that acts [rad].
        kp: (joints,) [N m/rad].
        stiffness: (joints,) of the drive [N m/rad], may be infinite.
        torque_limit: (joints,) [N m].

    Returns:
        position and torque, (..., T, joints).
    """
    jump = np.diff(command, axis=-2)
    free = np.abs(torque[..., 1:, :]) < 0.999 * torque_limit
    torque_jump = np.where(free, kp / (1 + kp / stiffness) * jump, 0.0)
    return position[..., 1:, :] - torque_jump / stiffness, torque[..., 1:, :] - torque_jump
