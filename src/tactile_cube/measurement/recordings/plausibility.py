"""Do the numbers fit the rig? Degrees, swapped joints, a flipped sign, a joint that never moves."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import TrialColumns
from tactile_cube.measurement.recordings.rig import RigJoint
from tactile_cube.measurement.recordings.trial import Array, Gains

DEGREE = math.pi / 180.0
MILLIMETRE = 1e-3
IN_DEGREES = "this looks like degrees, recordings are in rad: import it by record source=csv source.angle_unit=deg"
IN_MILLIMETRES = "this looks like mm, recordings are in m: import it by record source=csv source.length_unit=mm"
SLACK = 0.1  # [rad] beyond a joint's limit that offsets and soft stops explain
WRAP = 0.5  # [rad] within which a jump is a whole turn; no joint turns so far in a row
SMOOTH = 0.05  # of the command's scatter, below which a position is none that a sensor measured
MIRRORED = 0.7  # of a command's size and of the gain of slow motion, below which a sign is not flipped for sure
LEAST_FOLLOWED = 0.2  # part of a motor's motion that a link makes, whatever the gap between them
MOVES = 0.02  # [rad] range below which a signal says nothing about its neighbours


def check_units(columns: TrialColumns, joints: list[RigJoint], gains: Gains, path: Path) -> list[str]:
    """Return warnings about angles outside the joints' limits.

    Raises:
        InputError: angles that only make sense in degrees, or that make no sense at all.
    """
    warnings: list[str] = []
    for index, joint in enumerate(joints):
        for signal, values in (("position", columns.position), ("command", columns.command)):
            warnings += _check_reach(f"{joint.name}.{signal}", values[:, index], joint, path)
        _check_one_in_degrees(joint.name, columns.command[:, index], columns.position[:, index], path)
        warnings += _check_gain(joint.name, columns, index, gains, path)
    return warnings


def _check_reach(name: str, values: Array, joint: RigJoint, path: Path) -> list[str]:
    outside = joint.beyond(values)
    row, unit = int(np.argmax(outside)), "m" if joint.prismatic else "rad"
    limits = f"[{joint.lower:.4g}, {joint.upper:.4g}] {unit} of joint '{joint.name}' in the URDF"
    if not joint.reaches(values):
        small = MILLIMETRE if joint.prismatic else DEGREE
        fits = np.max(joint.beyond(values * small)) < SLACK
        hint = (IN_MILLIMETRES if joint.prismatic else IN_DEGREES) if fits else "check unit and joint"
        raise InputError(
            f"{path}: column '{name}', row {row}: {values[row]:.4g} is far outside the limits {limits}; {hint}"
        )
    if outside[row] > SLACK and name.endswith("position"):
        return [f"{path}: column '{name}', row {row}: {values[row]:.4g} is outside the limits {limits}; unit? joint?"]
    return []


def _check_one_in_degrees(joint: str, command: Array, position: Array, path: Path) -> None:
    if min(np.ptp(command), np.ptp(position)) == 0 or _correlation(command, position) < 0.95:
        return
    ratio = float(np.ptp(position) / np.ptp(command)) * DEGREE
    for signal, one in (("position", ratio), ("command", DEGREE**2 / ratio)):
        if 0.85 < one < 1.18:
            row = int(np.argmax(np.abs(position if signal == "position" else command)))
            raise InputError(
                f"{path}: column '{joint}.{signal}', row {row}: {signal} moves 180/pi times as far as its "
                f"counterpart: {IN_DEGREES}"
            )


def torque_over_law(columns: TrialColumns, index: int, gains: Gains) -> float | None:
    """Return the ratio of a joint's measured torque to the impedance law: 1 in the right units, whatever friction does.

    None: the one does not go with the other.
    """
    if columns.torque is None:
        return None
    position, torque = columns.position[:, index], columns.torque[:, index]
    velocity = np.gradient(np.convolve(np.pad(position, 5, mode="edge"), np.ones(11) / 11, "valid"), columns.time)
    expected = gains.kp[index] * (columns.command[:, index] - position) - gains.kd[index] * velocity
    if np.std(expected) == 0 or _correlation(expected, torque) < 0.8:
        return None
    return float(np.std(torque) / np.std(expected))


def _check_gain(joint: str, columns: TrialColumns, index: int, gains: Gains, path: Path) -> list[str]:
    slope, position = torque_over_law(columns, index, gains), columns.position[:, index]
    if slope is None:
        return []
    if 0.8 < slope / DEGREE < 1.25:
        row = int(np.argmax(np.abs(columns.command[:, index] - position)))
        raise InputError(
            f"{path}: column '{joint}.position', row {row}: {position[row]:.4g}, and the torque is pi/180 of "
            f"kp (command - position): either controller.kp is 57.3 times too large, or {IN_DEGREES}"
        )
    if not 0.2 < slope < 5:
        return [
            f"{path}: column '{joint}.torque' is {slope:.3g} times kp (command - position): check unit (N m) and kp"
        ]
    return []


def check_assignment(columns: TrialColumns, joints: list[RigJoint], path: Path) -> list[str]:
    """Return warnings about joints that do not answer to their commands.

    Raises:
        InputError: a joint follows another joint's command, or moves against its own.
    """
    warnings: list[str] = []
    for index, joint in enumerate(joints):
        position, command = columns.position[:, index], columns.command[:, index]
        if np.ptp(position) == 0:
            warnings.append(
                f"{path}: column '{joint.name}.position' never changes (row 0: {position[0]:.4g}); "
                f"the command moves by {np.ptp(command):.3g} rad"
            )
        if min(np.ptp(command), np.ptp(position)) < MOVES:
            continue
        own = _correlation(command, position)
        row = int(np.argmax(np.abs(position - command)))
        if own < -0.8:
            said = (
                f"{path}: column '{joint.name}.position', row {row}: {position[row]:.4g} at command "
                f"{command[row]:.4g}: the joint moves against its command (correlation {own:.2f}); "
            )
            if _mirrored(command, position):
                raise InputError(said + "flip the sign")
            warnings.append(said + "is its sign flipped, or is the command faster than the joint's resonance?")
        others = [_correlation(other, position) if np.ptp(other) > MOVES else 0.0 for other in columns.command.T]
        leader = int(np.argmax(others))
        if own < 0.4 and others[leader] > 0.9:
            said = (
                f"{path}: column '{joint.name}.position', row {row}: it follows the command of "
                f"'{joints[leader].name}' (correlation {others[leader]:.2f}), not its own ({own:.2f}); "
            )
            # a joint too weak for its command is dragged along by a neighbour that follows its own
            if _correlation(columns.command[:, leader], columns.position[:, leader]) < 0.4:
                raise InputError(said + "are the joints swapped?")
            warnings.append(said + "does the neighbour drag it along, or is it a copy of the neighbour's column?")
    return warnings


def _mirrored(command: Array, position: Array) -> bool:
    """Return whether a joint moves as far as its command but in the opposite direction, in slow and in fast motion.

    Beyond its resonance a joint also moves against its command, but its amplitude falls with the frequency.
    """
    asked, moved = (np.fft.rfft(one - one.mean())[1:] for one in (command, position))
    power = np.cumsum(np.abs(asked) ** 2)
    slow = power <= power[-1] / 2
    slow[0] = True
    if slow.all():
        return False
    gains = [
        -float(np.vdot(asked[band], moved[band]).real / np.vdot(asked[band], asked[band]).real)
        for band in (slow, ~slow)
    ]
    return MIRRORED < gains[0] < 1 / MIRRORED and gains[1] > MIRRORED * gains[0]


def check_roles(columns: TrialColumns, joints: tuple[str, ...], path: Path) -> list[str]:
    """Return warnings about a command that scatters as a sensor beside a position that does not: exchanged columns."""
    if len(columns.time) < 4:
        return []
    # third differences: zero of what is held, next to nothing of a smooth curve
    asked, moved = (np.median(np.abs(np.diff(one, 3, axis=0)), axis=0) for one in (columns.command, columns.position))
    return [
        f"{path}: column '{joint}.command' scatters by {asked[j]:.2g} from row to row and '{joint}.position' by "
        f"{moved[j]:.2g}, as if the one was measured and the other commanded: are they exchanged?"
        for j, joint in enumerate(joints)
        if moved[j] < SMOOTH * asked[j] and np.ptp(columns.position[:, j]) > 0
    ]


def without_wraps(columns: TrialColumns, joints: list[RigJoint], path: Path) -> tuple[TrialColumns, list[str]]:
    """Return positions and commands [rad] without jumps by whole turns between rows, and warnings of them."""
    turning, warnings, unwrapped = [not joint.prismatic for joint in joints], [], {}
    for key in ("position", "command"):
        values = getattr(columns, key)
        steps = np.diff(values, axis=0)
        wraps = (np.abs(np.abs(steps) - 2.0 * math.pi) < WRAP) & np.array(turning)
        for j in np.flatnonzero(wraps.any(axis=0)):
            row = int(np.argmax(wraps[:, j])) + 1
            warnings.append(
                f"{path}: column '{joints[j].name}.{key}', row {row}: {values[row, j]:.4g} after "
                f"{values[row - 1, j]:.4g}: jumps by a whole turn are taken out ({np.count_nonzero(wraps[:, j])})"
            )
        turns = np.cumsum(np.where(wraps, -np.sign(steps), 0.0), axis=0)
        unwrapped[key] = values + 2.0 * math.pi * np.vstack([np.zeros(values.shape[1]), turns])
    return replace(columns, **unwrapped), warnings


def _correlation(first: Array, second: Array) -> float:
    a, b = first - first.mean(), second - second.mean()
    scale = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    return float(np.sum(a * b)) / scale if scale > 0 else 0.0


def check_links(columns: TrialColumns, joints: tuple[str, ...], path: Path) -> None:
    """Refuse a sensor on a link in another unit than its motor's, or before its gear.

    Raises:
        InputError: a link moves clearly more or less than its motor.
    """
    if columns.link_position is None:
        return
    for link, motor, joint in zip(columns.link_position.T, columns.position.T, joints, strict=True):
        moved = motor - motor.mean()
        if np.isnan(link).all() or np.ptp(motor) < MOVES:
            continue
        ratio = float(moved @ (link - link.mean()) / (moved @ moved))
        if not LEAST_FOLLOWED < ratio < 1.0 / LEAST_FOLLOWED:
            raise InputError(
                f"{path}: column '{joint}.link_position' moves {ratio:.4g} times as far as '{joint}.position'; both "
                "are the joint's angle [rad]: divide a motor's by its gear ratio, and look at signs and units"
            )
