"""Logs of other programs on their way into a workbench: what is in them, how they are read, what is odd about them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactile_cube.api.job import as_input_errors
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import read_rig
from tactile_cube.measurement.recordings.tables import read_table
from tactile_cube.measurement.recordings.writing import require_free, write_recordings
from tactile_cube.measurement.sources.column_map import ColumnMap, map_columns
from tactile_cube.measurement.sources.csv_files import CsvFiles

LARGEST = 100_000_000
"""Bytes of one file that a browser hands over; larger ones are named by their path."""
TABLES, RIGS = (".csv", ".txt", ".parquet", ".npz"), (".urdf", ".xml")
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
        InputError: it is too large, or neither a log nor a URDF.
    """
    name = Path(name.replace("\\", "/")).name
    if Path(name).suffix.lower() not in (*TABLES, *RIGS):
        raise InputError(f"{name}: neither a log ({', '.join(TABLES)}) nor a mechanism ({', '.join(RIGS)})")
    if len(content) > LARGEST:
        raise InputError(f"{name}: {len(content) / 1e6:.0f} MB, more than {LARGEST / 1e6:.0f}; name its path instead")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(content)
    return folder / name


@as_input_errors
def preview(file: Path, urdf: Path) -> Preview:
    """Return what a log holds and which column seems to be what.

    Raises:
        InputError: a file that cannot be read.
    """
    table = read_table(file, only_numbers=False)
    joints = [name for name, joint in read_rig(urdf).joints.items() if joint.mimics is None]
    rows = [[float(column[k]) for column in table.values()] for k in range(min(SHOWN, len(next(iter(table.values())))))]
    try:
        guess, doubt = map_columns(list(table), joints, {}, False), ""
    except InputError as error:
        guess, doubt = None, str(error)
    return Preview(joints, list(table), rows, guess, doubt)


@as_input_errors
def import_logs(
    out: Path, files: Sequence[Path], urdf: Path, controller: Mapping[str, Any], **settings: Any
) -> tuple[Recording, list[str]]:
    """Write logs as a recording, read it back, and return it with what was understood and what is odd, a line each.

    Args:
        out: folder to write.
        files: one trial each.
        urdf: of the rig.
        controller: kp, kd, ...
        settings: others of `record source=csv`: columns, angle_unit, length, ...

    Raises:
        InputError: what cannot be used: file, column or row, the value, what to do.
    """
    require_free(out)
    made = CsvFiles(files=[str(file) for file in files], urdf=str(urdf), controller=controller, **settings)
    tables = made.recordings(0)
    write_recordings(out, tables)
    recording = read_recording(out)
    return recording, [_in_a_line(*row) for row in tables[""].understood]


def _in_a_line(what: str, how: str, by: str) -> str:
    """What was understood, marked as a guess where values told it."""
    guess = "guess: " if by.startswith(("values", "steps", "assumed")) else ""
    return f"{guess}{what}: {how}" + (f" ({by})" if by else "")
