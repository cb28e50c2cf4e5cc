"""Logs of other programs on their way into a workbench: what is in them, how they are read, what is odd about them."""

import contextlib
import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

from tactile_cube.api.job import as_input_errors
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import SIGNALS, pick_columns
from tactile_cube.measurement.recordings.description import ControllerChange, TrialEntry
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import read_rig
from tactile_cube.measurement.recordings.tables import read_table
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, require_free, write_recordings
from tactile_cube.measurement.sources.column_map import map_columns
from tactile_cube.measurement.sources.csv_files import kinds_of
from tactile_cube.measurement.sources.log_file import LEROBOT, READERS, read_logs
from tactile_cube.measurement.sources.mechanism import lever_rig
from tactile_cube.measurement.sources.source import recording_tables, source_settings
from tactile_cube.untrusted_file import below
from tactile_cube.whole_file import write_whole

LARGEST = 100_000_000
"""Bytes of one file that a browser hands over; larger ones are named by their path."""
NAME = 200
"""Bytes of a file's name; the system allows some more."""
LOGS, RIGS = tuple(READERS), (".urdf", ".xml")
BAGS = (".mcap", ".bag", ".db3")
SHOWN = 5  # rows
DOUBTS = {
    "position": "",
    "torque": "no column of commands: the torques are taken for the commands; if nothing drove the joint, say free",
    "free": "no column of commands: free swings? If torques are commanded or logged, say which column it is",
}
"""Mode of a controller, in the order in which they are tried -> what its columns leave open."""
WORDS = ("servo", "controller.mode", "read", "time_unit", "angle_unit", "length_unit", "torque_unit")
"""Settings of `record source=csv` that are no numbers."""


@dataclass(frozen=True)
class Preview:
    """What is in a log."""

    columns: list[str]
    rows: list[list[float]]  # the first ones
    guess: dict[str, dict[str, str]]  # `time`, and each joint that may be actuated -> signal -> column, "" where open
    doubt: str  # what the names leave open
    mode: str = "position"  # of the controller, `free` without a column of commands


@dataclass(frozen=True)
class Waiting:
    """Files that wait to be imported."""

    logs: tuple[Path, ...] = ()  # files, or folders of LeRobot
    urdf: Path | None = None  # of their rig
    robot: str | None = None  # pendulum, wheel or slide in its place
    calibration: Path | None = None  # LeRobot's, of the arm

    def with_files(self, files: Sequence[Path]) -> Self:
        """Return it with more files, each by what it is; new logs take the place of old ones."""
        of = {kind: [file for file in files if kind_of(file) == kind] for kind in ("log", "rig", "calibration")}
        changed = replace(
            self,
            logs=tuple(of["log"]) or self.logs,
            calibration=of["calibration"][-1] if of["calibration"] else self.calibration,
        )
        return replace(changed, urdf=of["rig"][-1], robot=None) if of["rig"] else changed

    @property
    def lacks(self) -> list[str]:
        """What is still needed, in words."""
        needed = {"a log": self.logs, "the URDF of the rig, or a choice of one joint": self.urdf or self.robot}
        return [what for what, there in needed.items() if not there]

    @property
    def settings(self) -> dict[str, Any]:
        """As `record source=csv` takes it."""
        named = {"urdf": self.urdf, "robot": self.robot, "calibration": self.calibration}
        return {"files": [str(log) for log in self.logs]} | {k: str(v) for k, v in named.items() if v is not None}

    @as_input_errors
    def preview(self) -> Preview | None:
        """Return what the first log holds and which column seems to be what; None: something is still needed."""
        if self.lacks:
            return None
        table = read_logs(self.logs[0])[0].table
        rig = read_rig(self.urdf) if self.urdf else lever_rig(str(self.robot))
        joints = [name for name, joint in rig.joints.items() if joint.mimics is None]
        names, count = list(table), min(SHOWN, len(next(iter(table.values()))))
        rows = [[float(column[k]) for column in table.values()] for k in range(count)]
        guess, refused = None, list[str]()
        for mode in DOUBTS:
            try:
                guess = map_columns(names, joints, {}, mode)
                break
            except InputError as error:
                refused.append(str(error))
        mode, doubt = (mode, DOUBTS[mode]) if guess else ("position", refused[0])
        known = guess.joints if guess else {}
        chosen = {joint: {signal: known.get(joint, {}).get(signal, "") for signal in SIGNALS} for joint in joints}
        time = {"time": {"time": (guess.time if guess else None) or ""}}
        return Preview(names, rows, time | chosen, doubt, mode)


def kept(folder: Path, name: str, content: bytes) -> Path:
    """Write a log or URDF that a browser handed over and return its path; of its name only the last part counts."""
    name = Path(name.replace("\\", "/")).name
    if not name.isprintable() or len(os.fsencode(name)) > NAME:
        raise InputError(f"{name[:NAME]!r}: no name of a file here; give it one of at most {NAME} printable characters")
    _require_known(Path(name))
    if len(content) > LARGEST:
        raise InputError(f"{name}: {len(content) / 1e6:.0f} MB, more than {LARGEST / 1e6:.0f}; name its path instead")
    place = folder / LEROBOT if name == LEROBOT.name and b'"features"' in content else folder / name
    place.parent.mkdir(parents=True, exist_ok=True)
    write_whole(place, content)
    return place


def kind_of(file: Path) -> str:
    """Return what a file is: log, rig, calibration, or what LeRobot says of its columns (description)."""
    if (file / LEROBOT).is_file():
        return "log"
    _require_known(file)
    if file.parts[-2:] == LEROBOT.parts:
        return "description"
    if file.suffix.lower() in RIGS:
        return "rig"
    with contextlib.suppress(OSError, ValueError, TypeError, AttributeError, RecursionError):  # its reader says why
        read = json.loads(file.read_text(encoding="utf-8")) if file.suffix.lower() == ".json" else {}
        return "calibration" if read and all("range_max" in one for one in read.values()) else "log"
    return "log"


def _require_known(file: Path) -> None:
    ending = file.suffix.lower()
    if ending in BAGS:
        convert = "" if ending == ".mcap" else f" (from {ending} convert it to MCAP first)"
        raise InputError(
            f"{file.name}: a ROS bag; import it with: python -m tactile_cube.record source=mcap "
            f"'source.files=[{file.with_suffix('.mcap').name}]' source.urdf=URDF 'source.joints=[JOINT, ...]' "
            f"source.controller.kp=KP source.controller.kd=KD out=FOLDER{convert}; then open FOLDER here"
        )
    if ending not in (*LOGS, *RIGS):
        raise InputError(f"{file.name}: neither a log ({', '.join(LOGS)}) nor a mechanism ({', '.join(RIGS)})")


def settings_of(typed: Mapping[str, str]) -> dict[str, Any]:
    """Return settings of `record source=csv` from texts of a form; a key with a dot is one of a mapping.

    Example:
        >>> settings_of({"controller.kp": "25, 12", "read": "after", "initialisation": "0"})
        {'controller': {'kp': [25.0, 12.0]}, 'read': 'after', 'initialisation': [0]}
    """
    settings: dict[str, Any] = {}
    for key, text in typed.items():
        group, _, name = key.rpartition(".")
        place = settings.setdefault(group, {}) if group else settings
        place[name] = text if key in WORDS and not text.isdecimal() else _numbers(name, text)
    return settings


def number(key: str, text: str) -> float:
    """Return what somebody typed as a number; `key` names it where it is none."""
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{key}: '{text}' is no number") from None


def _numbers(key: str, text: str) -> float | int | list[float] | list[int]:
    """Read one number, or one for each of several joints or files."""
    numbers = [number(key, part) for part in re.split(r"[\s,;]+", text.strip(" ,;[]\t\n"))]
    whole = [int(one) for one in numbers if one.is_integer()]
    if key == "initialisation":
        if len(whole) < len(numbers):
            raise InputError(f"{key}: '{text}': give a whole number for each file")
        return whole
    if key.endswith("_unit") and whole:
        return whole[0]
    return numbers[0] if len(numbers) == 1 else numbers


@as_input_errors
def import_logs(out: Path, given: Mapping[str, Any], before: Recording | None = None) -> tuple[Recording, list[str]]:
    """Write logs as a recording, as `record source=csv` does; return it and what was understood, a line each.

    Args:
        out: folder to write.
        given: settings of `record source=csv`.
        before: a recording of the same rig to whose trials they are added, as trials of one more initialisation. Where
            `given` says nothing of the controller its gains hold; what its owner believes stays.

    Raises:
        InputError: what cannot be used: file, column or row, the value, what to do.
    """
    require_free(out)
    controller = dict(given.get("controller", {}))
    known = {} if before is None else before.description.controller.model_dump(exclude_none=True)
    settings = source_settings("csv", {**given, "controller": {**controller, **known}})
    made = recording_tables(settings, "csv", 0)[""]
    write_recordings(out, {"": made if before is None else _added(before, made, controller)})
    return read_recording(out), [_in_a_line(*row) for row in made.understood]


def _added(before: Recording, made: RecordingTables, controller: Mapping[str, Any]) -> RecordingTables:
    """Return the trials of a recording, followed by those of another one of the same rig."""
    joints, described = before.joints, before.description
    if tuple(made.description.joints) != joints:
        raise InputError(f"{before.folder}: has joints {', '.join(joints)}; say columns of all of them in the new logs")
    old = []
    for entry in described.trials:
        path = below(before.folder, entry.file, "trials.file")
        columns, _ = pick_columns(read_table(path), joints, path)
        old.append(TrialTable(entry, **vars(columns), origin=path))
    both = [*old, *made.tables]
    groups = kinds_of([Path(one.entry.file).stem for one in both], [one.command for one in both], before.step)
    kinds = {group: one.entry.kind for group, one in zip(groups, old, strict=False)}
    again = 1 + max(entry.initialisation for entry in described.trials)
    gains = ControllerChange(**{key: controller[key] for key in ControllerChange.model_fields if key in controller})
    new = []
    for group, table in zip(groups[len(old) :], made.tables, strict=True):
        entry = TrialEntry(
            file=f"trials/{again}_{Path(table.entry.file).name}",
            initialisation=again,
            kind=kinds.get(group, f"{group}_{again}"),
            controller=gains if gains.model_fields_set else None,
            note=table.entry.note,
        )
        new.append(replace(table, entry=entry))
    doubts = [*described.doubts, *made.description.doubts]
    return RecordingTables(described.model_copy(update={"doubts": doubts}), before.rig.text, [*old, *new])


def _in_a_line(what: str, how: str, by: str) -> str:
    """Describe one thing understood, marked as a guess where it was inferred from values."""
    guess = "guess: " if by.startswith(("values", "steps", "assumed")) else ""
    return f"{guess}{what}: {how}" + (f" ({by})" if by else "")
