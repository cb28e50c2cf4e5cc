"""Which column is which signal of which joint, as far as the user did not say, guessed from the names."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import SIGNALS
from tactile_cube.measurement.sources.units import NO_TORQUE, UNITS, of_motor, words

Given = Mapping[str, str | Mapping[str, str]]
EXAMPLE = "source.columns='{time: TIME, JOINT: {command: COLUMN, position: COLUMN, torque: COLUMN}}'"


def _vocabulary(text: str) -> frozenset[str]:
    return frozenset(text.split())


TIME = _vocabulary("time timestamp stamp elapsed clock zeit uhrzeit millis micros secs sec seconds")
COMMAND = _vocabulary(
    "command cmd commanded goal target desired des ref reference setpoint sp soll action demand demanded"
)
POSITION = _vocabulary(
    "position pos angle q measured meas actual present state observation encoder enc ist theta feedback joint"
)
LINK, FEEDFORWARD = _vocabulary("link load output secondary"), _vocabulary("feedforward forward ff")
ANGLE = _vocabulary("position pos angle q encoder enc theta")  # a "Present Load" is none
TORQUE = _vocabulary("torque tau effort moment force nm mnm")
NOT_USED = NO_TORQUE | _vocabulary(
    "velocity vel speed dq qdot qvel omega acc acceleration ddq temperature temp error err index frame link"
)
VOLTAGE, SUPPLY = _vocabulary("voltage volt volts"), _vocabulary("bus vbus supply battery input vin")
ELEMENT = re.compile(r"\[\d+\]$")  # of an array
DESIRED = (["q", "d"], ["qd"])  # desired position in some papers, speed in others


@dataclass(frozen=True)
class ColumnMap:
    """Column names."""

    time: str | None  # None where the rows have no time of their own
    joints: dict[str, dict[str, str]]  # joint -> one of SIGNALS -> column
    unused: tuple[str, ...]
    doubts: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """All columns that are used."""
        signals = [column for entry in self.joints.values() for column in entry.values()]
        return signals if self.time is None else [self.time, *signals]


def time_of(names: Sequence[str]) -> str | None:
    """Return the column of time, found by its name."""
    return min((name for name in names if _signal_of(name) == "time"), key=lambda name: len(words(name)), default=None)


def map_columns(
    names: Sequence[str], joints: Sequence[str], given: Given, mode: str = "position", flags: Collection[str] = ()
) -> ColumnMap:
    """Map a table's columns to joints: as `given`, or else to all of `joints` that appear in the columns' names.

    `flags` are columns of only 0 and 1, which are not torques; in mode `free` no command is needed.

    Raises:
        InputError: something is missing or ambiguous.
    """
    said = {joint: dict(entry) for joint, entry in given.items() if isinstance(entry, Mapping)}
    if other := given.keys() - said.keys() - {"time"}:
        raise InputError(f"source.columns.{min(other)}={given[min(other)]}: no mapping; expected {EXAMPLE}")
    chosen = said or _guessed(names, joints, mode, flags)
    _require_whole(chosen, names, mode)
    time = given.get("time", time_of(names))
    used = {time, *(column for entry in chosen.values() for column in entry.values())}
    unused, doubts = tuple(name for name in names if name not in used), []
    arrays = [name for name in unused if ELEMENT.search(name) and ELEMENT.sub("[0]", name) in used]
    if arrays and not said:
        doubts = [
            f"{', '.join(arrays)}: more columns than joints of the URDF ({', '.join(joints)}), taken in its order"
        ]
    return ColumnMap(str(time) if time is not None else None, chosen, unused, tuple(doubts))


def _guessed(
    names: Sequence[str], joints: Sequence[str], mode: str, flags: Collection[str]
) -> dict[str, dict[str, str]]:
    signals = _signals(names, joints, mode, flags)
    owners = _owners(list(signals), joints)
    free = {signal: name for name, signal in signals.items() if not owners[name]}
    if set(NEEDED[mode]) <= set(free) and not any(owners.values()):
        command = f"'{free['command']}' looks like a command and " if "command" in free else ""
        raise InputError(
            f"source.columns: {command}'{free['position']}' {'looks ' * (not command)}like a position, but "
            f"of which joint? The URDF has {', '.join(joints)}: say it by {EXAMPLE}"
        )
    for name, signal in signals.items():
        # what names no joint is the only joint's if it has no such signal yet
        if len(joints) == 1 and not owners[name] and list(signals.values()).count(signal) == 1:
            owners[name] = joints[0]
    found: dict[str, dict[str, str]] = {}
    for name, signal in signals.items():
        entry = found.setdefault(owners[name], {})
        if signal == "position" and signal in entry and of_motor(name) != of_motor(entry[signal]):
            motor, link = sorted((name, entry[signal]), key=of_motor, reverse=True)
            entry |= {"position": motor, "link_position": link}
            continue
        if owners[name] and signal in entry and signal != "torque":
            raise InputError(
                f"source.columns: '{entry[signal]}' and '{name}' could both be the {signal} of '{owners[name]}'; "
                f"say which: {EXAMPLE}"
            )
        entry.setdefault(signal, name)
    for entry in found.values():
        if "link_position" in entry and "position" not in entry:
            entry["position"] = entry.pop("link_position")  # the only sensor there is
    return {joint: found[joint] for joint in joints if set(NEEDED[mode]) <= set(found.get(joint, ()))}


def _signals(names: Sequence[str], joints: Sequence[str], mode: str, flags: Collection[str]) -> dict[str, str]:
    signals: dict[str, str] = {}
    for name in names:
        signal = _signal_of(name)
        if signal is None and any(_without_unit(name) == words(joint) for joint in joints):
            signal = "position"
        if signal is not None and signal != "time" and not (name in flags and signal.startswith("torque")):
            signals[name] = signal
    if "command" not in signals.values():
        plain = {name: [word for word in _without_unit(name) if not word.isdigit()] for name in names}
        signals |= {name: "command" for name in names if plain[name] in DESIRED}
    if mode == "position":
        return {name: signal for name, signal in signals.items() if signal in SIGNALS}
    wanted = {"torque": ("torque_command", "torque"), "voltage": ("voltage",), "free": ("",)}[mode]
    asked = next((one for one in wanted if one in signals.values()), "command" if mode != "free" else "")
    kept = {name: signal for name, signal in signals.items() if signal in ("position", "link_position", asked)}
    return {name: "command" if signal == asked else signal for name, signal in kept.items()}


def _owners(names: Sequence[str], joints: Sequence[str]) -> dict[str, str]:
    """Return column -> joint: by the joint's name, by a number, or because there is only one joint."""
    named = {n: max((joint for joint in joints if _names(n, joint)), key=len, default="") for n in names}
    if any(named.values()):
        return named
    places = {name: int(words(name)[-1]) if ELEMENT.search(name) else -1 for name in names}
    if min(places.values(), default=-1) == 0:
        return {name: joints[place] if place < len(joints) else "" for name, place in places.items()}
    numbers = {name: [int(word) for word in words(name) if word.isdigit()][-1:] for name in names}
    known = [number for last in numbers.values() for number in last]
    if known and min(known) <= 1 and max(known) - min(known) < len(joints):
        return {name: joints[last[0] - min(known)] if last else "" for name, last in numbers.items()}
    return dict.fromkeys(names, joints[0] if len(joints) == 1 else "")


NEEDED = {mode: ("command", "position") for mode in ("position", "torque", "voltage")} | {"free": ("position",)}
"""Mode -> signals that a joint must have."""
COMMANDED = {
    "position": "a commanded position", "torque": "a commanded torque", "voltage": "a commanded voltage",
    "free": "a swing without command",
}  # fmt: skip


def _require_whole(chosen: Mapping[str, Mapping[str, str]], names: Sequence[str], mode: str) -> None:
    if not chosen:
        what = "a position" if mode == "free" else f"both {COMMANDED[mode]} and a position"
        others = [f"{one} ({COMMANDED[one]})" for one in COMMANDED if one != mode]
        raise InputError(
            f"source.columns: no joint of the URDF has {what} among the columns {list(names)}; "
            f"say which they are: {EXAMPLE}, or source.controller.mode={', '.join(others)}"
        )
    for joint, entry in chosen.items():
        missing = [signal for signal in NEEDED[mode] if signal not in entry]
        if missing:
            raise InputError(
                f"source.columns.{joint}: {' and '.join(missing)} missing, received {dict(entry)}; expected "
                f"{{command: COLUMN, position: COLUMN}}, columns are {list(names)}"
            )
        if unknown := set(entry) - set(SIGNALS):
            raise InputError(f"source.columns.{joint}.{min(unknown)}: unknown; known are {', '.join(SIGNALS)}")


def _signal_of(name: str) -> str | None:
    """Return the signal that a column's name indicates: time, one of SIGNALS, torque_command, voltage or None."""
    said = words(name)
    if TIME & set(said) or (said[:1] == ["t"] and len(said) <= 2):
        return "time"
    commanded = bool(COMMAND & set(said))
    if FEEDFORWARD & set(said):
        torque = TORQUE & set(said) or (said[-1] == "feedforward" and not NOT_USED & set(said))
        return "feedforward" if torque else None
    if VOLTAGE & set(said):
        return None if SUPPLY & set(said) else "voltage"
    if TORQUE & set(said) and NO_TORQUE & set(said):
        return None
    if TORQUE & set(said):
        return "torque_command" if commanded else "torque"
    if LINK & set(said) and ANGLE & set(said) and not commanded:
        return "link_position"
    if NOT_USED & set(said):
        return None
    if commanded:
        return "command"
    return "position" if POSITION & set(said) else None


def _without_unit(name: str) -> list[str]:
    known = {unit for spellings in UNITS.values() for unit in spellings}
    return [word for word in words(name) if word not in known]


def _names(name: str, joint: str) -> bool:
    said, part = words(name), words(joint)
    return "".join(part) in said or any(said[k : k + len(part)] == part for k in range(len(said) - len(part) + 1))
