"""Which column is which signal of which joint, as far as the user did not say, guessed from the names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import SIGNALS
from tactile_cube.measurement.sources.units import (
    Signal,
    joint_in,
    may_be_desired,
    number_of,
    of_motor,
    signal_of,
    without_unit,
    words,
)

Given = Mapping[str, str | Mapping[str, str]]
EXAMPLE = "source.columns='{time: TIME, JOINT: {command: COLUMN, position: COLUMN, torque: COLUMN}}'"


@dataclass(frozen=True)
class ColumnMap:
    """Column names.

    Attributes:
        time: None where the rows have no time of their own.
        joints: joint -> {command, position, torque, link_position, feedforward} -> column.
        unused: columns that are left aside.
    """

    time: str | None
    joints: dict[str, dict[str, str]]
    unused: tuple[str, ...]


def map_columns(names: Sequence[str], joints: Sequence[str], given: Given, torque_mode: bool) -> ColumnMap:
    """The map of a table's columns.

    Args:
        names: of the columns.
        joints: of the URDF, those that may be actuated.
        given: what the user said: `time` and any joint; what is said of no joint is guessed.
        torque_mode: commands are torques.

    Raises:
        InputError: something is missing or can be read in two ways.
    """
    said = {joint: dict(entry) for joint, entry in given.items() if isinstance(entry, Mapping)}
    chosen = said or _guessed(names, joints, torque_mode)
    _require_whole(chosen, names, torque_mode)
    time = given.get("time", _time(names))
    used = {time, *(column for entry in chosen.values() for column in entry.values())}
    return ColumnMap(str(time) if time is not None else None, chosen, tuple(n for n in names if n not in used))


def _time(names: Sequence[str]) -> str | None:
    found = [name for name in names if signal_of(name) == "time"]
    return min(found, key=lambda name: len(words(name)), default=None)


def _guessed(names: Sequence[str], joints: Sequence[str], torque_mode: bool) -> dict[str, dict[str, str]]:
    signals = _signals(names, joints, torque_mode)
    owners = _owners(list(signals), joints)
    _say_which_joint(signals, owners, joints)
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
    return {joint: found[joint] for joint in joints if len({"command", "position"} & set(found.get(joint, ()))) == 2}


def _signals(names: Sequence[str], joints: Sequence[str], torque_mode: bool) -> dict[str, Signal]:
    """Column -> command, position or torque."""
    signals: dict[str, Signal] = {}
    for name in names:
        signal = signal_of(name)
        if signal is None and any(without_unit(name) == words(joint) for joint in joints):
            signal = "position"
        if signal is not None and signal != "time":
            signals[name] = signal
    if "command" not in signals.values():
        signals |= {name: "command" for name in names if may_be_desired(name)}
    if not torque_mode:
        return {name: signal for name, signal in signals.items() if signal != "torque_command"}
    asked = next((one for one in ("torque_command", "torque") if one in signals.values()), "command")
    kept: dict[str, Signal] = {
        name: signal for name, signal in signals.items() if signal in ("position", "link_position", asked)
    }
    return {name: "command" if signal == asked else signal for name, signal in kept.items()}


def _owners(names: Sequence[str], joints: Sequence[str]) -> dict[str, str]:
    """Column -> joint: by the joint's name, by a number, or because there is only one joint."""
    named = {name: joint_in(name, joints) for name in names}
    if any(named.values()):
        return {name: joint or "" for name, joint in named.items()}
    numbers = {name: number_of(name) for name in names}
    known = [number for number in numbers.values() if number is not None]
    if known and min(known) <= 1 and max(known) - min(known) < len(joints):
        return {n: joints[k - min(known)] if k is not None else "" for n, k in numbers.items()}
    return dict.fromkeys(names, joints[0] if len(joints) == 1 else "")


def _say_which_joint(signals: Mapping[str, Signal], owners: Mapping[str, str], joints: Sequence[str]) -> None:
    """Refuse signals that nothing ties to one of several joints."""
    free = {signal: name for name, signal in signals.items() if not owners[name]}
    if {"command", "position"} <= set(free) and not any(owners.values()):
        raise InputError(
            f"source.columns: '{free['command']}' looks like a command and '{free['position']}' like a position, but "
            f"of which joint? The URDF has {', '.join(joints)}: say it by {EXAMPLE}"
        )


def _require_whole(chosen: Mapping[str, Mapping[str, str]], names: Sequence[str], torque_mode: bool) -> None:
    what = "command (a torque)" if torque_mode else "command"
    if not chosen:
        hint = "" if torque_mode else ", or source.controller.mode=torque where torques were commanded"
        raise InputError(
            f"source.columns: no joint of the URDF has both a {what} and a position among the columns {list(names)}; "
            f"say which they are: {EXAMPLE}{hint}"
        )
    for joint, entry in chosen.items():
        missing = [signal for signal in ("command", "position") if signal not in entry]
        if missing:
            raise InputError(
                f"source.columns.{joint}: {' and '.join(missing)} missing, received {dict(entry)}; expected "
                f"{{command: COLUMN, position: COLUMN}}, columns are {list(names)}"
            )
        if unknown := set(entry) - set(SIGNALS):
            raise InputError(f"source.columns.{joint}.{min(unknown)}: unknown; known are {', '.join(SIGNALS)}")
