"""In which unit a column is: what the user says, or its name, or its values."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.rig import RigJoint

Signal = Literal["time", "command", "position", "torque", "torque_command", "link_position", "feedforward"]
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")


def _vocabulary(text: str) -> frozenset[str]:
    return frozenset(text.split())


TIME = _vocabulary("time timestamp stamp elapsed clock zeit millis micros secs sec seconds")
COMMAND = _vocabulary(
    "command cmd commanded goal target desired des ref reference setpoint sp soll action demand demanded"
)
POSITION = _vocabulary("position pos angle q measured meas actual present state encoder enc ist theta feedback joint")
MOTOR, LINK = _vocabulary("motor mot rotor"), _vocabulary("link load output secondary")
FEEDFORWARD = _vocabulary("feedforward forward ff")
TORQUE = _vocabulary("torque tau effort moment force nm mnm")
NOT_USED = _vocabulary(  # load: of hobby servos, a share of something
    "velocity vel speed dq qdot qvel omega acc acceleration ddq current curr voltage volt temperature temp pwm "
    "error err status index frame load link"
)
DESIRED = (["q", "d"], ["qd"])  # desired position in some papers, speed in others
UNITS: dict[str, tuple[str, ...]] = {
    "deg": ("deg", "degs", "degree", "degrees"), "rad": ("rad", "rads", "radian", "radians"), "mrad": ("mrad",),
    "turn": ("turn", "turns", "rev", "revs", "revolutions"),
    "s": ("s", "sec", "secs", "second", "seconds"), "ms": ("ms", "msec", "millis", "milliseconds"),
    "us": ("us", "usec", "micros", "microseconds"), "ns": ("ns", "nsec", "nanos", "nanoseconds"),
    "mm": ("mm", "millimetres", "millimeters"), "um": ("um",),
}  # fmt: skip
TORQUE_UNIT = re.compile(r"(?<![a-z])(?:([mc]?)n[ .*·_]?m|n[ .*·_]?([mc])m)(?![a-z])", re.IGNORECASE)
TORQUE_PREFIX = {"": "Nm", "m": "mNm", "c": "Ncm"}


def words(name: str) -> list[str]:
    """`q1_desDeg` -> q, 1, des, deg."""
    return [word.lower() for word in WORD.findall(name)]


def signal_of(name: str) -> Signal | None:
    """The signal that a column's name promises, or None."""
    said = words(name)
    if TIME & set(said) or (said[:1] == ["t"] and len(said) <= 2):
        return "time"
    commanded = bool(COMMAND & set(said))
    if FEEDFORWARD & set(said):
        return "feedforward" if TORQUE & set(said) else None
    if TORQUE & set(said):
        return "torque_command" if commanded else "torque"
    if LINK & set(said) and POSITION & set(said) and not commanded:
        return "link_position"
    if NOT_USED & set(said):
        return None
    if commanded:
        return "command"
    return "position" if POSITION & set(said) else None


def may_be_desired(name: str) -> bool:
    """Whether the name is q_d or qd, with or without a number and a unit."""
    return [word for word in without_unit(name) if not word.isdigit()] in DESIRED


def without_unit(name: str) -> list[str]:
    """The words of a name but for units."""
    known = {unit for spellings in UNITS.values() for unit in spellings}
    return [word for word in words(name) if word not in known]


def of_motor(name: str) -> bool:
    """Whether the name says that it is the motor's."""
    return bool(MOTOR & set(words(name)))


def joint_in(name: str, joints: Iterable[str]) -> str | None:
    """The joint whose name is in a column's name, the longest if there are several."""
    said = words(name)
    found = [joint for joint in joints if _contains(said, words(joint))]
    return max(found, key=len, default=None)


def _contains(said: Sequence[str], part: Sequence[str]) -> bool:
    if "".join(part) in said:
        return True
    return any(list(said[k : k + len(part)]) == list(part) for k in range(len(said) - len(part) + 1))


def number_of(name: str) -> int | None:
    """The last number in a column's name."""
    numbers = [int(word) for word in words(name) if word.isdigit()]
    return numbers[-1] if numbers else None


def unit_of(name: str, units: Iterable[str]) -> str | None:
    """The unit, one of `units`, that the name ends with or has in brackets."""
    allowed = set(units)
    torque = TORQUE_UNIT.search(name)
    if torque is not None and allowed & set(TORQUE_PREFIX.values()):
        return TORQUE_PREFIX[(torque.group(1) or torque.group(2) or "").lower()]
    if "°" in name and "deg" in allowed:
        return "deg"
    for word in reversed(words(name)[1:] or words(name)):
        for unit in allowed:
            if word in UNITS.get(unit, ()):
                return unit
    return None


Array = NDArray[np.float64]
ANGLE_UNITS = {"rad": 1.0, "deg": np.pi / 180, "turn": 2 * np.pi, "mrad": 1e-3}
LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
TORQUE_UNITS = {"Nm": 1.0, "mNm": 1e-3, "Ncm": 1e-2}
FORCE_UNITS = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
GEARED = 1.5  # turns of a motor a turn of its link, from which on there is a gear between them
SLOWEST = 0.1  # [s] between samples of a log that shows a drive
NOT_ALIKE = 0.05  # range of a position over that of its command, below which they are in different units


@dataclass(frozen=True)
class Unit:
    """A unit: its name, its size in SI units, and what told it."""

    name: str
    size: float
    source: str


def chosen_unit(said: str | None, name: str, units: Mapping[str, float], key: str) -> Unit | None:
    """The unit that the user or else the column's name says.

    Raises:
        InputError: no such unit.
    """
    if said is not None:
        if said not in units:
            raise InputError(f"source.{key}={said}: unknown; choose one of {', '.join(units)}")
        return Unit(said, units[said], f"source.{key}")
    found = unit_of(name, units)
    return None if found is None else Unit(found, units[found], "its name")


def time_unit(said: str | None, name: str, time: Array) -> Unit:
    """Unit of time stamps; steps of more than 0.1 cannot be seconds, of more than 100 no milliseconds, and so on."""
    chosen = chosen_unit(said, name, TIME_UNITS, "time_unit")
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if chosen is not None and (said is not None or step * chosen.size <= 10 * SLOWEST):
        return chosen
    unit = next((unit for unit, size in TIME_UNITS.items() if step * size <= SLOWEST * 1.001), "ns")
    return Unit(unit, TIME_UNITS[unit], f"steps of {step:g}")


def position_unit(said: str | None, name: str, values: Array, joint: RigJoint) -> Unit:
    """Unit of angles (or metres of a sliding joint): the first that fits the joint's limits."""
    units = LENGTH_UNITS if joint.prismatic else ANGLE_UNITS
    chosen = chosen_unit(said, name, units, "length_unit" if joint.prismatic else "angle_unit")
    if chosen is not None:
        return chosen
    for unit in ("m", "mm") if joint.prismatic else ("rad", "deg"):
        if joint.reaches(values * units[unit]):
            return Unit(unit, units[unit], f"values {values.min():.3g} .. {values.max():.3g} and the joint's limits")
    first = next(iter(units))
    return Unit(first, 1.0, "assumed: no unit fits the joint's limits")


def at_the_joint(unit: Unit, gear: float) -> Unit:
    """The unit of an angle, or a torque, of a motor as it is at its joint, so many turns of the motor a turn there."""
    size = unit.size * gear if unit.name in {*TORQUE_UNITS, *FORCE_UNITS} else unit.size / gear
    return Unit(f"{unit.name} of the motor", size, f"{gear:.5g} turns a turn of its link")


def gear_of(motor: Array, link: Array) -> float:
    """Turns of the motor a turn of the link, from their angles in one unit; 1 where they move alike."""
    moved = link - link.mean()
    size = float(moved @ moved)
    gear = float(moved @ (motor - motor.mean())) / size if size > 0.0 else 1.0
    return gear if abs(gear) > GEARED or gear < 0.0 else 1.0


def same_unit(command: Unit, position: Unit, ratio: float) -> tuple[Unit, Unit]:
    """Units of a command and its position, one for both where values alone told them and the motions are alike.

    Args:
        command: its unit.
        position: its unit.
        ratio: range of the position over that of the command, as logged.
    """
    guessed = not {"its name"} & {command.source, position.source}
    if command.name == position.name or not guessed or not NOT_ALIKE < ratio < 1 / NOT_ALIKE:
        return command, position
    smaller = min(command, position, key=lambda unit: unit.size)
    return smaller, smaller


def torque_unit(said: str | None, name: str, prismatic: bool) -> Unit:
    """Unit of torques, or of a sliding joint's forces; N m or N where nothing is said."""
    if prismatic:
        return chosen_unit(said, name, FORCE_UNITS, "torque_unit") or Unit("N", 1.0, "assumed")
    return chosen_unit(said, name, TORQUE_UNITS, "torque_unit") or Unit("Nm", 1.0, "assumed")
