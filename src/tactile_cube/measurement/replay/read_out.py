"""What a log shows of a simulation: the state at an instant, under the command of the period that ends or begins."""

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.replay.windows import Windows

Array = NDArray[np.float64]
FEWEST = 3  # steps of a row of which two feel nothing of the row before


def simulated_jumps(acting: Array, windows: Windows) -> Array:
    """Simulated command at each reading less the one that the log feels (S, K segment, n).

    Known exactly unless an effect changes the command on its way; then half the change across the reading, smoothed
    where a row is one step.

    Args:
        acting: (S, K segment substeps, n) what acted in each step [rad].
        windows: what was simulated.
    """
    first, fine = windows.history * windows.substeps, windows.substeps
    if np.array_equal(acting, windows.commands[:, first:]):
        return windows.jump
    jumps = np.zeros_like(acting[:, ::fine])
    if fine == 1:
        jumps[:, 1:-1] = 0.25 * (acting[:, 2:] - acting[:, :-2])
    else:
        jumps[:, 1:] = 0.5 * (acting[:, fine + 1 :: fine] - acting[:, fine - 1 : -fine : fine])
    return jumps


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
        position: (..., joints) simulated motor positions at the instants of reading [rad].
        torque: (..., joints) [N m].
        jump: (..., joints) the simulated command less the one that the log feels [rad].
        ratios: (..., joints) jump of position [1] and of torque [N m/rad] per jump of the command, see `jump_ratio`.
        torque_limit: (..., joints) [N m]; a torque at its limit does not jump.
        free: (..., joints) the part of the jump that the motor follows without torque [rad], see `free_way`.

    Returns:
        position and torque, (..., joints): without the jump in torque and in the drive's deflection.
    """
    felt = np.where(np.abs(torque) < 0.999 * torque_limit, jump - free, 0.0)
    return position - free - ratios[0] * felt, torque - ratios[1] * felt


def before_steps(signals: Array, segment: int, substeps: int) -> tuple[Array, NDArray[np.bool_]]:
    """What a row would show had its command not changed: the line through the last two steps of the row before.

    For a jump of the command that asks for much: `jump_ratio` does not know where a torque meets its limit.

    Args:
        signals: (S, K segment substeps, ..., joints) of every step.
        segment: rows after which the simulation starts anew.
        substeps: steps of a row; the first one takes the mean of two commands, so there must be three.

    Returns:
        (S, K segment, ..., joints), and which rows have a row before them (K segment,).
    """
    shown = signals[:, ::substeps].copy()
    known = np.arange(shown.shape[1]) % segment > 0
    if substeps < FEWEST:
        return shown, np.zeros_like(known)
    last = np.flatnonzero(known) * substeps - 1
    shown[:, known] = 2.0 * signals[:, last] - signals[:, last - 1]
    return shown, known
