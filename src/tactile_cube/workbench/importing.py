"""Logs of other programs on their way into a workbench: what is in them, how they are read, what is odd about them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tactile_cube.api.job import as_input_errors
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import pick_columns
from tactile_cube.measurement.recordings.description import ControllerChange, TrialEntry
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import read_rig
from tactile_cube.measurement.recordings.tables import read_table
from tactile_cube.measurement.recordings.writing import (
    RecordingTables,
    TrialTable,
    require_free,
    write_recordings,
)
from tactile_cube.measurement.sources.column_map import ColumnMap, map_columns
from tactile_cube.measurement.sources.csv_files import CsvFiles, kinds_of
from tactile_cube.measurement.sources.log_file import read_logs
from tactile_cube.untrusted_file import below
from tactile_cube.whole_file import write_whole

LARGEST = 100_000_000
"""Bytes of one file that a browser hands over; larger ones are named by their path."""
NAME = 200
"""Bytes of a file's name; the system allows some more."""
TABLES, RIGS = (".csv", ".txt", ".parquet", ".npz"), (".urdf", ".xml")
BAGS = (".mcap", ".bag", ".db3")
SHOWN = 5  # rows


@dataclass(frozen=True)
class Preview:
    """What is in a log.

    Attributes:
        joints: of the URDF, those that may be actuated.
        columns: their names.
        rows: the first ones.
        guess: which column is what; None where the names leave it open.
        doubt: what they leave open.
    """

    joints: list[str]
    columns: list[str]
    rows: list[list[float]]
    guess: ColumnMap | None
    doubt: str


def kept(folder: Path, name: str, content: bytes) -> Path:
    """Write a file that a browser handed over and return its path; of its name only the last part counts.

    Raises:
        InputError: it is too large, neither a log nor a URDF, or has a name that no file can have here.
    """
    name = Path(name.replace("\\", "/")).name
    if not name.isprintable() or len(os.fsencode(name)) > NAME:
        raise InputError(f"{name[:NAME]!r}: no name of a file here; give it one of at most {NAME} printable characters")
    require_known(Path(name))
    if len(content) > LARGEST:
        raise InputError(f"{name}: {len(content) / 1e6:.0f} MB, more than {LARGEST / 1e6:.0f}; name its path instead")
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / name, content)
    return folder / name


def require_known(file: Path) -> None:
    """Refuse what is no log and no URDF.

    Raises:
        InputError: it is; for a bag with the command that imports it.
    """
    ending = file.suffix.lower()
    if ending in BAGS:
        convert = "" if ending == ".mcap" else f" (from {ending} convert it to MCAP first)"
        raise InputError(
            f"{file.name}: a ROS bag; import it with: python -m tactile_cube.record source=mcap "
            f"'source.files=[{file.with_suffix('.mcap').name}]' source.urdf=URDF 'source.joints=[JOINT, ...]' "
            f"source.controller.kp=KP source.controller.kd=KD out=FOLDER{convert}; then open FOLDER here"
        )
    if ending not in (*TABLES, *RIGS):
        raise InputError(f"{file.name}: neither a log ({', '.join(TABLES)}) nor a mechanism ({', '.join(RIGS)})")


@as_input_errors
def preview(file: Path, urdf: Path) -> Preview:
    """Return what a log holds and which column seems to be what.

    Raises:
        InputError: a file that cannot be read.
    """
    table = read_logs(file)[0].table
    joints = [name for name, joint in read_rig(urdf).joints.items() if joint.mimics is None]
    rows = [[float(column[k]) for column in table.values()] for k in range(min(SHOWN, len(next(iter(table.values())))))]
    try:
        guess, doubt = map_columns(list(table), joints, {}), ""
    except InputError as error:
        guess, doubt = None, str(error)
    return Preview(joints, list(table), rows, guess, doubt)


@as_input_errors
def import_logs(
    out: Path,
    files: Sequence[Path],
    urdf: Path,
    controller: Mapping[str, Any],
    before: Recording | None = None,
    **settings: Any,
) -> tuple[Recording, list[str]]:
    """Write logs as a recording, read it back, and return it with what was understood and what is odd, a line each.

    Args:
        out: folder to write.
        files: one trial each.
        urdf: of the rig.
        controller: kp, kd, ...
        before: a recording of the same rig to whose trials they are added, as trials of one more initialisation. Where
            `controller` says nothing its gains hold; what its owner believes stays.
        settings: others of `record source=csv`: columns, angle_unit, length, ...

    Raises:
        InputError: what cannot be used: file, column or row, the value, what to do.
    """
    require_free(out)
    known = {} if before is None else before.description.controller.model_dump(exclude_none=True)
    made = CsvFiles([str(file) for file in files], str(urdf), {**controller, **known}, **settings).recordings(0)[""]
    understood = [_in_a_line(*row) for row in made.understood]
    write_recordings(out, {"": made if before is None else _added(before, made, controller)})
    return read_recording(out), understood


def _added(before: Recording, made: RecordingTables, controller: Mapping[str, Any]) -> RecordingTables:
    """The trials of a recording, and after them those of another one of the same rig."""
    joints = before.joints
    if tuple(made.description.joints) != joints:
        raise InputError(f"{before.folder}: has joints {', '.join(joints)}; say columns of all of them in the new logs")
    old = []
    for entry in before.description.trials:
        path = below(before.folder, entry.file, "trials.file")
        columns, _ = pick_columns(read_table(path), joints, path)
        old.append(TrialTable(entry, columns.time, columns.command, columns.position, columns.torque, path))
    both = [*old, *made.tables]
    initialisation = 1 + max(entry.initialisation for entry in before.description.trials)
    gains = ControllerChange(**{key: value for key, value in controller.items() if key != "mode"})
    groups = kinds_of([Path(one.entry.file).stem for one in both], [one.command for one in both], before.step)
    kinds = {group: one.entry.kind for group, one in zip(groups, old, strict=False)}
    new = []
    for group, table in zip(groups[len(old) :], made.tables, strict=True):
        entry = TrialEntry(
            file=f"trials/{initialisation}_{Path(table.entry.file).name}",
            initialisation=initialisation,
            kind=kinds.get(group, f"{group}_{initialisation}"),
            controller=gains if gains.model_fields_set else None,
            note=table.entry.note,
        )
        new.append(replace(table, entry=entry))
    doubts = [*before.description.doubts, *made.description.doubts]
    return RecordingTables(before.description.model_copy(update={"doubts": doubts}), before.urdf, [*old, *new])


def _in_a_line(what: str, how: str, by: str) -> str:
    """What was understood, marked as a guess where values told it."""
    guess = "guess: " if by.startswith(("values", "steps", "assumed")) else ""
    return f"{guess}{what}: {how}" + (f" ({by})" if by else "")
