"""In which unit a column is: what the user says, or its name, or its values."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.rig import RigJoint

Array = NDArray[np.float64]
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
UNITS: dict[str, tuple[str, ...]] = {
    "deg": ("deg", "degs", "degree", "degrees"), "rad": ("rad", "rads", "radian", "radians"), "mrad": ("mrad",),
    "turn": ("turn", "turns", "rev", "revs", "revolutions"),
    "s": ("s", "sec", "secs", "second", "seconds"), "ms": ("ms", "msec", "millis", "milliseconds"),
    "us": ("us", "usec", "micros", "microseconds"), "ns": ("ns", "nsec", "nanos", "nanoseconds"),
    "mm": ("mm", "millimetres", "millimeters"), "um": ("um",),
}  # fmt: skip
TORQUE_UNIT = re.compile(r"(?<![a-z])(?:([mc]?)n[ .*·_]?m|n[ .*·_]?([mc])m)(?![a-z])", re.IGNORECASE)
TORQUE_PREFIX = {"": "Nm", "m": "mNm", "c": "Ncm"}
ANGLE_UNITS = {"rad": 1.0, "deg": np.pi / 180, "turn": 2 * np.pi, "mrad": 1e-3}
LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
TORQUE_UNITS = {"Nm": 1.0, "mNm": 1e-3, "Ncm": 1e-2}
FORCE_UNITS = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
TICKS = frozenset({"tick", "ticks", "count", "counts", "raw"})
USUAL_TICKS, FEWEST_TICKS = 4096, 16  # of a turn: of hobby servos, and of any encoder that tells an angle
GEARED = 1.5  # turns of a motor a turn of its link, from which on there is a gear between them
SLOWEST = 0.1  # [s] between samples of a log that shows a drive
NOT_ALIKE = 0.05  # range of a position over that of its command, below which they are in different units


def words(name: str) -> list[str]:
    """`q1_desDeg` -> q, 1, des, deg."""
    return [word.lower() for word in WORD.findall(name)]


def of_motor(name: str) -> bool:
    """Whether a column's name says that it is the motor's."""
    return bool({"motor", "mot", "rotor"} & set(words(name)))


def _unit_of(name: str, allowed: Mapping[str, float]) -> str | None:
    """The unit, one of those allowed, that the name ends with or has in brackets."""
    torque = TORQUE_UNIT.search(name)
    if torque is not None and set(allowed) & set(TORQUE_PREFIX.values()):
        return TORQUE_PREFIX[(torque.group(1) or torque.group(2) or "").lower()]
    if "°" in name and "deg" in allowed:
        return "deg"
    for word in reversed(words(name)[1:] or words(name)):
        for unit in allowed:
            if word in UNITS.get(unit, ()):
                return unit
    return None


@dataclass(frozen=True)
class Unit:
    """A unit: its name, its size in SI units, what told it, and the reading that is zero."""

    name: str
    size: float
    source: str
    zero: float = 0.0

    @property
    def said(self) -> bool:
        """Whether the user or the column's name says it, and not the values."""
        return self.source.startswith(("its name", "source."))

    def of(self, values: Array) -> Array:
        """Values in SI units."""
        return (values - self.zero) * self.size


def chosen_unit(said: str | int | None, name: str, units: Mapping[str, float], key: str) -> Unit | None:
    """The unit that the user or else the column's name says.

    Raises:
        InputError: no such unit.
    """
    if said is not None:
        if said not in units:
            raise InputError(f"source.{key}={said}: unknown; choose one of {', '.join(units)}")
        return Unit(str(said), units[str(said)], f"source.{key}")
    found = _unit_of(name, units)
    return None if found is None else Unit(found, units[found], "its name")


def time_unit(said: str | None, name: str, time: Array) -> Unit:
    """Unit of time stamps; steps of more than 0.1 cannot be seconds, of more than 100 no milliseconds, and so on."""
    chosen = chosen_unit(said, name, TIME_UNITS, "time_unit")
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if chosen is not None and (said is not None or step * chosen.size <= 10 * SLOWEST):
        return chosen
    unit = next((unit for unit, size in TIME_UNITS.items() if step * size <= SLOWEST * 1.001), "ns")
    return Unit(unit, TIME_UNITS[unit], f"steps of {step:g}")


def position_unit(said: str | int | None, name: str, values: Array, joint: RigJoint) -> Unit:
    """Unit of angles (or metres of a sliding joint): the first that fits the joint's limits.

    `said` may be the ticks of an encoder's turn.

    Raises:
        InputError: no such unit, or ticks of which nothing tells how many a turn has.
    """
    values = values[np.isfinite(values)]
    if not values.size:
        raise InputError(f"column '{name}': has no number")
    if not joint.prismatic and said is not None and str(said).isdecimal():
        return _ticks(int(said), values, joint, "source.angle_unit")
    if not joint.prismatic and said is None and TICKS & set(words(name)) and not (values % 1.0).any():
        if not 0.0 <= values.min() <= values.max() < USUAL_TICKS:
            raise InputError(
                f"column '{name}': ticks from {values.min():g} to {values.max():g}; of how many is a turn? "
                "source.angle_unit=TICKS, for instance 4096"
            )
        return _ticks(USUAL_TICKS, values, joint, f"its name; {USUAL_TICKS} a turn is assumed")
    units = LENGTH_UNITS if joint.prismatic else ANGLE_UNITS
    chosen = chosen_unit(said, name, units, "length_unit" if joint.prismatic else "angle_unit")
    if chosen is not None:
        return chosen
    by = "the joint's limits" if np.isfinite(joint.upper - joint.lower) else "no limits of the joint that would tell"
    for unit in ("m", "mm") if joint.prismatic else ("rad", "deg"):
        if joint.reaches(values * units[unit]):
            return Unit(unit, units[unit], f"values {values.min():.3g} .. {values.max():.3g} and {by}")
    first = next(iter(units))
    return Unit(first, 1.0, "assumed: no unit fits the joint's limits")


def _ticks(turn: int, values: Array, joint: RigJoint, source: str) -> Unit:
    """Ticks of an encoder, with the zero at 0 or in the middle of the turn.

    It is where the joint leaves its limits less; where it keeps them both ways, where it is nearer to the motion.
    """
    if turn < FEWEST_TICKS:
        raise InputError(f"source.angle_unit={turn}: a turn has more ticks; for instance {USUAL_TICKS}")
    size, middle = 2 * np.pi / turn, 0.5 * (values.min() + values.max())

    def outside(zero: float) -> tuple[float, float]:
        return max(float(np.max(joint.beyond((values - zero) * size))), 0.0), abs(middle - zero)

    zero = min(0.0, turn / 2, key=outside)
    return Unit(f"ticks, {zero:g} is zero", size, source, zero)


def geared(
    units: Mapping[str, Unit], logged: Mapping[str, Array], columns: Mapping[str, str], said: float | None = None
) -> dict[str, Unit]:
    """Units of what is logged on the motor's side of a gear, as it is at the joint.

    The motor's angle and the link's tell the gear. Commands are on the motor's side where they reach that far,
    torques where their column says so.

    Args:
        units: of the signals of one joint, `link_position` among them.
        logged: what the columns have.
        columns: their names.
        said: turns of the motor a turn of its link, if the user says them.
    """
    angles = [signal for signal in units if units[signal].name not in {*TORQUE_UNITS, *FORCE_UNITS}]
    # no joint's limits tell the unit of a motor's angle; its link's is the best guess
    told = {signal: units[signal if units[signal].said else "link_position"] for signal in angles}
    moved = {signal: (logged[signal] - logged[signal].mean()) * told[signal].size for signal in angles}
    link = moved["link_position"]
    gear = said or float(link @ moved["position"]) / max(float(link @ link), 1e-30)
    if said is None and 0.0 <= gear < GEARED:
        return {}
    beside = [signal for signal in units if signal not in ("position", "link_position") and of_motor(columns[signal])]
    if "command" in angles and np.ptp(moved["command"]) > np.sqrt(abs(gear)) * np.ptp(link):
        beside.append("command")
    found = {}
    for signal in {"position", *beside}:
        unit = told.get(signal, units[signal])
        size = unit.size / gear if signal in angles else unit.size * gear
        by = f"{gear:.5g} turns a turn of its link{', by their motion; source.gear=... if known' if not said else ''}"
        found[signal] = Unit(f"{unit.name} of the motor", size, by, unit.zero)
    return found


def same_unit(command: Unit, position: Unit, ratio: float) -> tuple[Unit, Unit]:
    """Units of a command and its position: one zero, and one unit where values alone told it and the motions are alike.

    `ratio` is the range of the position over that of the command, as logged.
    """
    if command.size == position.size and command.zero != position.zero:
        return (command, command) if command.zero > position.zero else (position, position)
    guessed = not (command.said or position.said)
    if command.name == position.name or not guessed or not NOT_ALIKE < ratio < 1 / NOT_ALIKE:
        return command, position
    smaller = min(command, position, key=lambda unit: unit.size)
    return smaller, smaller


def torque_unit(said: str | None, name: str, prismatic: bool) -> Unit:
    """Unit of torques, or of a sliding joint's forces; N m or N where nothing is said."""
    units = FORCE_UNITS if prismatic else TORQUE_UNITS
    return chosen_unit(said, name, units, "torque_unit") or Unit(next(iter(units)), 1.0, "assumed")
