"""Unit of a column, from the user, its name or its values."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import Array
from tactile_cube.measurement.recordings.rig import RigJoint
from tactile_cube.untrusted_file import read_text

Spans = Mapping[str, float]
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-zµμ]+|\d+")
UNITS: dict[str, tuple[str, ...]] = {
    "deg": ("deg", "degs", "degree", "degrees"), "rad": ("rad", "rads", "radian", "radians"), "mrad": ("mrad",),
    "turn": ("turn", "turns", "rev", "revs", "revolutions"),
    "s": ("s", "sec", "secs", "second", "seconds"), "ms": ("ms", "msec", "millis", "milliseconds"),
    "us": ("us", "µs", "μs", "usec", "micros", "microseconds"), "ns": ("ns", "nsec", "nanos", "nanoseconds"),
    "mm": ("mm", "millimetres", "millimeters"), "um": ("um",), "V": ("v", "volt", "volts"), "mV": ("mv",),
}  # fmt: skip
TORQUE_UNIT = re.compile(r"(?<![a-z])(?:([mc]?)n[ .*·_]?m|n[ .*·_]?([mc])m)(?![a-z])", re.IGNORECASE)
TORQUE_PREFIX = {"": "Nm", "m": "mNm", "c": "Ncm"}
ANGLE_UNITS = {"rad": 1.0, "deg": np.pi / 180, "turn": 2 * np.pi, "mrad": 1e-3}
LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
TORQUE_UNITS = {"Nm": 1.0, "mNm": 1e-3, "Ncm": 1e-2}
FORCE_UNITS = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
VOLT_UNITS = {"V": 1.0, "mV": 1e-3}
NO_TORQUE = frozenset({"voltage", "volt", "volts", "current", "curr", "pwm", "duty", "load", "status"})
NO_TORQUE |= {"enable", "enabled", "flag", "mode", "limit"}
"""Words of a name that say that it is no torque."""
RANGE, LEROBOT = "range", re.compile(r"(action|observation)(?![a-z])", re.IGNORECASE)
TICKS = frozenset({"tick", "ticks", "count", "counts", "raw"})
USUAL_TICKS, FEWEST_TICKS = 4096, 16  # of a turn: of hobby servos, and of any encoder that measures an angle
GEARED = 1.5  # turns of a motor a turn of its link, from which on there is a gear between them
SLOWEST = 0.1  # [s] between samples of a log that shows a drive
NOT_ALIKE = 0.05  # range of a position over that of its command, below which they are in different units


def words(name: str) -> list[str]:
    """Return the words of a name: `q1_desDeg` -> q, 1, des, deg."""
    return [word.lower() for word in WORD.findall(name)]


def of_motor(name: str) -> bool:
    """Return whether a column's name indicates that it is the motor's."""
    return bool({"motor", "mot", "rotor"} & set(words(name)))


@dataclass(frozen=True)
class Unit:
    """The unit of a column."""

    name: str
    size: float  # in SI units
    source: str  # where the unit was found
    zero: float = 0.0  # the reading that is zero
    doubt: str = ""  # what is assumed without proof

    @property
    def said(self) -> bool:
        """Whether the user or the column's name says it, and not the values."""
        return self.source.startswith(("its name", "source."))

    def of(self, values: Array) -> Array:
        """Convert values to SI units."""
        return (values - self.zero) * self.size


def chosen_unit(said: str | int | None, name: str, units: Mapping[str, float], key: str) -> Unit | None:
    """Return the unit that the user states, or else that in the column's name.

    Raises:
        InputError: no such unit.
    """
    if said is not None:
        if said not in units:
            others = f", {RANGE} (LeRobot's -100 .. 100) or the ticks of a turn" if key == "angle_unit" else ""
            raise InputError(f"source.{key}={said}: unknown; choose one of {', '.join(units)}{others}")
        return Unit(str(said), units[str(said)], f"source.{key}")
    torque = TORQUE_UNIT.search(name)
    if torque is not None and units.keys() & set(TORQUE_PREFIX.values()):
        found = TORQUE_PREFIX[(torque.group(1) or torque.group(2) or "").lower()]
    elif "°" in name and "deg" in units:
        found = "deg"
    else:
        spelt = reversed(words(name)[1:] or words(name))
        found = next((unit for word in spelt for unit in units if word in UNITS.get(unit, ())), "")
    return Unit(found, units[found], "its name") if found else None


def time_unit(said: str | None, name: str, time: Array) -> Unit:
    """Return the unit of time stamps; steps of more than 0.1 cannot be seconds, of more than 100 no milliseconds."""
    chosen = chosen_unit(said, name, TIME_UNITS, "time_unit")
    steps = np.diff(time)
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    if chosen is not None and (said is not None or step * chosen.size <= 10 * SLOWEST):
        return chosen
    unit = next((unit for unit, size in TIME_UNITS.items() if step * size <= SLOWEST * 1.001), "ns")
    return Unit(unit, TIME_UNITS[unit], f"steps of {step:g}")


def position_unit(
    said: str | int | None, name: str, values: Array, joint: RigJoint, spans: Spans = MappingProxyType({})
) -> Unit:
    """Return the unit of positions: the first that fits the joint's limits, in doubt without any.

    `said` may be the ticks of an encoder's turn, or `range`: LeRobot's share of the calibrated range of each motor,
    in which `spans` (motor -> [rad]) or else the joint's limits are -100 .. 100 (0 .. 100 of a gripper).

    Raises:
        InputError: no such unit, or ticks whose number a turn is unknown.
    """
    if said == RANGE:
        return _share(name, joint, spans)
    lerobot = LEROBOT.match(name) is not None and not joint.prismatic
    if lerobot and said in (None, "deg") and _grips(name, joint) and (spans or np.isfinite(joint.upper - joint.lower)):
        share = _share(name, joint, spans)  # LeRobot's grippers have no degrees
        return replace(share, doubt="" if said else f"taken for {share.name}, as LeRobot writes grippers")
    if isinstance(said, int):
        return _ticks(said, values, joint, "source.angle_unit")
    if said is None and TICKS & set(words(name)) and not (values % 1.0).any():
        if not 0.0 <= values.min() <= values.max() < USUAL_TICKS:
            raise InputError(
                f"column '{name}': ticks from {values.min():g} to {values.max():g}; of how many is a turn? "
                "source.angle_unit=TICKS, for instance 4096"
            )
        ticks = _ticks(USUAL_TICKS, values, joint, f"its name; {USUAL_TICKS} a turn is assumed")
        return replace(ticks, doubt=f"{USUAL_TICKS} ticks a turn are assumed; source.angle_unit=TICKS if not")
    key, units = ("length_unit", LENGTH_UNITS) if joint.prismatic else ("angle_unit", ANGLE_UNITS)
    if (chosen := chosen_unit(said, name, units, key)) is not None:
        return chosen
    range_ = f"values {values.min():.3g} .. {values.max():.3g}"
    unit = next(
        (u for u in (("m", "mm") if joint.prismatic else ("rad", "deg")) if joint.reaches(values * units[u])), ""
    )
    if not unit:
        unit, by = next(iter(units)), "assumed: no unit fits the joint's limits"
        doubt = f"taken for {unit}, which does not fit the joint's limits ({range_}); source.{key}=UNIT"
    elif np.isfinite(joint.upper - joint.lower):
        by, doubt = f"{range_} and the joint's limits", ""
    else:
        by = f"{range_} and no limits of the joint that would tell"
        doubt = f"taken for {unit}, which no limits of the joint prove; source.{key}={unit} if so"
    if lerobot and np.abs(values).max() <= 100.0:
        ways = "LeRobot writes degrees or -100 .. 100 of the calibrated range: source.angle_unit=deg or range"
        doubt = f"taken for {unit}; {ways}"
    return Unit(unit, units[unit], by, doubt=doubt)


def _grips(name: str, joint: RigJoint) -> bool:
    return "gripper" in {*words(name), *words(joint.name)}


def _share(name: str, joint: RigJoint, spans: Spans) -> Unit:
    """Return unit of -100 .. 100 of a range about its middle, or 0 .. 100 of a gripper's from its lower limit on."""
    motor = next((one for one in spans if set(words(one)) <= {*words(name), *words(joint.name)}), None)
    span = spans[motor] if motor is not None else joint.upper - joint.lower
    if not 0.0 < span < np.inf:
        raise InputError(
            f"source.angle_unit=range: joint '{joint.name}' has no limits; give source.calibration=FILE of the arm"
        )
    if spans and motor is None:
        raise InputError(f"source.calibration: no motor of joint '{joint.name}'; it has {', '.join(spans)}")
    by = f"source.calibration: {span:.4g} rad" if motor else f"source.angle_unit, {span:.4g} rad between its limits"
    lower = joint.lower if np.isfinite(joint.lower) else 0.0
    if _grips(name, joint):
        return Unit("0 .. 100 of its range", span / 100.0, by, zero=-lower * 100.0 / span)
    middle = 0.0 if motor is not None else 0.5 * (joint.lower + joint.upper)
    return Unit("-100 .. 100 of its range", span / 200.0, by, zero=-middle * 200.0 / span)


def calibrated_spans(path: Path) -> dict[str, float]:
    """Return motor -> range of motion [rad] of LeRobot's calibration file.

    Raises:
        InputError: it is none.
    """
    try:
        motors = json.loads(read_text(path))
        ticks = {name: float(one["range_max"]) - float(one["range_min"]) for name, one in motors.items()}
    except InputError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(
            f"{path}: not LeRobot's calibration, {{MOTOR: {{range_min: TICKS, range_max: TICKS}}}}: {error!r}"
        ) from None
    return {name: 2 * np.pi * one / USUAL_TICKS for name, one in ticks.items()}


def _ticks(turn: int, values: Array, joint: RigJoint, source: str) -> Unit:
    """Return ticks with the zero at 0 or in mid-turn: where the joint leaves its limits less, or is nearer."""
    if turn < FEWEST_TICKS:
        raise InputError(f"source.angle_unit={turn}: a turn has more ticks; for instance {USUAL_TICKS}")
    size, middle = 2 * np.pi / turn, 0.5 * (values.min() + values.max())

    def outside(zero: float) -> tuple[float, float]:
        return max(float(np.max(joint.beyond((values - zero) * size))), 0.0), abs(middle - zero)

    zero = 0.0 if values.min() < 0.0 else min(0.0, turn / 2, key=outside)  # a counter that starts anew, or absolute
    return Unit(f"ticks, {zero:g} is zero", size, source, zero)


def geared(
    units: Mapping[str, Unit], logged: Mapping[str, Array], columns: Mapping[str, str], said: float | None = None
) -> dict[str, Unit]:
    """Return units of what is logged on the motor's side of a gear, as the motor's and the link's angle tell them.

    Commands are on the motor's side if their range fits it, torques if their column's name says so. `said`: turns of
    the motor a turn of its link, if the user says them.
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
    """Return one zero for command and position, and one unit where values alone told it and the motions are alike.

    `ratio` is the range of the position over that of the command, as logged.
    """
    if command.size == position.size and command.zero != position.zero:
        return (command, command) if command.zero > position.zero else (position, position)
    guessed = not (command.said or position.said)
    if command.name == position.name or not guessed or not NOT_ALIKE < ratio < 1 / NOT_ALIKE:
        return command, position
    smaller = min(command, position, key=lambda unit: unit.size)
    return smaller, smaller


def torque_unit(said: str | None, name: str, prismatic: bool, values: Array) -> Unit:
    """Return the unit of torques, or of a sliding joint's forces: N m or N in doubt.

    Raises:
        InputError: the column is no torque: its name says so, or it holds 0 and 1 alone.
    """
    units = FORCE_UNITS if prismatic else TORQUE_UNITS
    unit, first = chosen_unit(said, name, units, "torque_unit"), next(iter(units))
    if unit is None and (NO_TORQUE & set(words(name)) or is_flag(values)):
        raise InputError(
            f"column '{name}': {'0 and 1 alone are' if is_flag(values) else 'by its name'} no torque; leave it out of "
            f"source.columns, use source.controller.mode=voltage with kt and R, or say source.torque_unit={first}"
        )
    doubt = f"taken for {first}, which nothing says; source.torque_unit={first} if so"
    return unit or Unit(first, 1.0, "assumed", doubt=doubt)


def is_flag(values: Array) -> bool:
    """Return whether a column holds both 0 and 1, and nothing else."""
    return bool(np.isin(values, (0.0, 1.0)).all() and np.ptp(values) > 0)


def voltage_unit(name: str, torque: float) -> Unit:
    """Return the unit of a motor's voltage, which makes `torque` [N m] at standstill a volt."""
    unit = chosen_unit(None, name, VOLT_UNITS, "") or Unit("V", 1.0, "assumed")
    return Unit(f"{unit.name} x kt / R", unit.size * torque, f"source.controller.kt, R; {unit.source}")
