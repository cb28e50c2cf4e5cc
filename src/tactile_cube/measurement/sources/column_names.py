"""What a column's name says: which signal it is, of which joint, in which unit."""

import re
from collections.abc import Iterable, Sequence
from typing import Literal

Signal = Literal["time", "command", "position", "torque", "torque_command"]
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")


def _vocabulary(text: str) -> frozenset[str]:
    return frozenset(text.split())


TIME = _vocabulary("time timestamp stamp elapsed clock zeit millis micros secs sec seconds")
COMMAND = _vocabulary(
    "command cmd commanded goal target desired des ref reference setpoint sp soll action demand demanded"
)
POSITION = _vocabulary("position pos angle q measured meas actual present state encoder enc ist theta feedback joint")
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
    if TORQUE & set(said):
        return "torque_command" if commanded else "torque"
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
