"""What a log shows of a simulation at an instant, and how much of a jump of the command its sensors show at once."""

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain import Plant
from tactile_cube.drivetrain.effects.transmission import Backlash, StiffeningElasticity
from tactile_cube.drivetrain.signals import COMMAND, LEAD, LOOP_GAIN, MOTOR_POSITION, TORQUE
from tactile_cube.measurement.replay.windows import SAFE, Windows

Array = NDArray[np.float64]
SEEN = MOTOR_POSITION, TORQUE, COMMAND, LEAD, LOOP_GAIN
PROBE = 0.05  # [rad] beyond every dead zone
NOTHING = 1e-9  # part of the probe below which it is rounding that passes


def jump_ratio(plant: Plant, memory: Array, command: Array) -> tuple[Array, Array]:
    """Return the jump of the measured position [1] and of the torque [N m/rad] per jump of the command, each (n,).

    What a motor follows freely within a gap is no part of either, see `free_way`.

    Two steps of a copy, with and without a jump in the second one. An effect that holds the command back, such as a
    delay, does not let the probe pass; then the plain drive's ratio holds, for the jump comes later.

    `memory` (size,) is the model at the start of a trial, `command` (n,) in [rad].
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
    """Return the width of the gap that each joint's motor moves through freely (..., n) [rad]; 0 without one."""
    if Backlash not in plant.effects:
        return np.zeros(len(plant.joint_names))
    _, gap, smooth, _, crossing = np.moveaxis(plant.view(memory, "parameters:backlash"), -1, 0)
    return np.asarray(np.where(crossing <= 0.0, gap, 0.0) + smooth)


def free_way(plant: Plant, memory: Array, jump: Array, lead: Array, gain: Array) -> Array:
    """Return the part of a jump of the command [rad] that a motor makes freely within the gap of a transmission.

    Memory is (..., size), `jump` (..., n); `lead` and `gain` are the signals LEAD and LOOP_GAIN after the jump.
    """
    if not gaps(plant, memory).any():
        return np.zeros_like(jump)
    p = plant.view(memory, "parameters:backlash")
    return Backlash.free_lead(lead, p, gain) - Backlash.free_lead(lead - jump, p, gain)


def spring_ratios(
    plant: Plant, memory: Array, jump: Array, torque: Array, ratios: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Return the `ratios` of `jump_ratio` for each reading (..., n): a stiffening spring yields less the more it bears.

    What passes of the command's lead over the joint is the deflection and the torque over kp. At once passes as much of
    a jump as the ratios say together. Memory is (..., size); `jump` [rad] and the `torque` after it [N m] are (..., n).
    """
    if StiffeningElasticity not in plant.effects:
        return ratios
    soft, cubic = np.moveaxis(plant.view(memory, "parameters:stiffening_elasticity"), -1, 0)
    kp, compliance = plant.view(memory, "kp"), plant.view(memory, "compliance") + soft
    stiffening = (cubic > 0.0) & (compliance > 0.0) & (jump != 0.0)
    if not stiffening.any():
        return ratios
    linear, cubic = 1.0 / np.where(compliance > 0.0, compliance, 1.0), np.where(cubic > 0.0, cubic, 1.0)
    passed = (ratios[0] + ratios[1] / kp) * jump
    after = cubic_root(linear, cubic, torque)
    before = cubic_root(linear + kp, cubic, kp * after + torque - kp * passed)
    position = (after - before) / np.where(stiffening, jump, 1.0)
    found = position, kp * (passed / np.where(stiffening, jump, 1.0) - position)
    return np.where(stiffening, found[0], ratios[0]), np.where(stiffening, found[1], ratios[1])


def cubic_root(linear: Array, cubic: Array, load: Array) -> Array:
    """Return the real root d of cubic * d^3 + linear * d = load (Cardano)."""
    half_width = np.sqrt(linear / cubic / 3.0)
    return np.asarray(2.0 * half_width * np.sinh(np.arcsinh(1.5 * load / (linear * half_width)) / 3.0))


FEWEST = 3  # steps of a row of which two feel nothing of the row before


def simulated_jumps(acting: Array, windows: Windows) -> Array:
    """Return the simulated command at each reading less the one that the log feels (S, K segment, n).

    Known exactly unless an effect changes the command on its way; then half the change across the reading, smoothed
    where a row is one step. `acting` (S, K segment substeps, n) acted in each step [rad].
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
    """Return the position [rad] and torque [N m] (..., joints) under the command that a log's instant feels.

    What was simulated under a command that is `jump` [rad] more, of which the motor follows `free` without torque (see
    `free_way`), is freed of the jump in torque and deflection (`ratios`, see `jump_ratio`), unless its torque is at the
    limit.
    """
    felt = np.where(np.abs(torque) < 0.999 * torque_limit, jump - free, 0.0)
    return position - free - ratios[0] * felt, torque - ratios[1] * felt


def before_steps(signals: Array, segment: int, substeps: int) -> tuple[Array, NDArray[np.bool_]]:
    """Extrapolate each row from the last two steps of the row before, as if its command had not changed.

    For a jump of the command that may saturate the torque, as `jump_ratio` ignores the torque limit. From signals of
    every step (S, K segment substeps, ..., joints), three a row at least since the first one takes the mean of two
    commands, it returns (S, K segment, ..., joints), and which rows have a row before them (K segment,).
    """
    shown = signals[:, ::substeps].copy()
    known = np.arange(shown.shape[1]) % segment > 0
    if substeps < FEWEST:
        return shown, np.zeros_like(known)
    last = np.flatnonzero(known) * substeps - 1
    shown[:, known] = 2.0 * signals[:, last] - signals[:, last - 1]
    return shown, known
