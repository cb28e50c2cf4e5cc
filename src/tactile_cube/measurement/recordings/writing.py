"""Write a recording: recording.yaml, rig.urdf and one table a trial."""

import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import polars
import yaml
from numpy.typing import NDArray

from tactile_cube.errors import InputError, warn
from tactile_cube.measurement.recordings.columns import MINIMUM_SAMPLES, SIGNALS, rows_of
from tactile_cube.measurement.recordings.description import Description, TrialEntry
from tactile_cube.measurement.recordings.reading import DESCRIPTION, read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.untrusted_file import below
from tactile_cube.whole_file import whole_file, write_npz, write_whole, written_together

Array = NDArray[np.float64]
BLOCK = 100_000  # rows of a table that are written at a time: signals may lie on the disk, as those of a log do


@dataclass(frozen=True)
class TrialTable:
    """One trial to be written: its entry, time (n,) [s] and signals (n, joints)."""

    entry: TrialEntry
    time: Array
    command: Array
    position: Array
    torque: Array | None = None
    origin: Path | None = None  # the file that it was read from
    link_position: Array | None = None  # nan where a joint has no sensor on its link
    feedforward: Array | None = None


@dataclass(frozen=True)
class RecordingTables:
    """A recording to be written."""

    description: Description  # its trials come from the tables
    urdf: str  # the text
    tables: Sequence[TrialTable]
    understood: Sequence[tuple[str, str, str]] = ()  # how an importer read files: what, how, and the source


def write_recording(folder: Path, recording: RecordingTables) -> None:
    """Write a recording into a folder; its recording.yaml appears last.

    Raises:
        InputError: a trial's file, which a log may have named, lies outside of it.
    """
    description, tables = recording.description, recording.tables
    for table in tables:
        below(folder, table.entry.file, "trials.file")
    data = description.model_dump(exclude_defaults=True, exclude_none=True, exclude={"trials"})
    entries = [  # file, initialisation and kind always, the rest where it was said
        table.entry.model_dump(include={"file", "initialisation", "kind"})
        | table.entry.model_dump(exclude_defaults=True, exclude_none=True)
        for table in tables
    ]
    ordered = {"format": 1, "rig": description.rig} | data | {"trials": entries}
    text = yaml.safe_dump(ordered, sort_keys=False, allow_unicode=True)
    with written_together(folder, DESCRIPTION) as aside:
        for table in tables:
            _write_table(aside / table.entry.file, table, description.joints)
        write_whole(aside / description.rig, recording.urdf.encode())
        write_whole(aside / DESCRIPTION, text.encode())


def _write_table(path: Path, table: TrialTable, joints: Sequence[str]) -> None:
    """Write one trial as Parquet, CSV or NPZ, by the ending of `path`; signals as 32-bit numbers, time as 64-bit."""
    columns = {"time": table.time}
    for index, joint in enumerate(joints):
        for signal in SIGNALS:
            values = getattr(table, signal)
            if values is not None and not np.isnan(values[:, index]).all():
                columns[f"{joint}.{signal}"] = values[:, index]
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npz":
        return write_npz(path, _narrow(columns))
    if path.suffix == ".csv":
        return write_whole(path, polars.DataFrame(_narrow(columns)).write_csv().encode())
    from pyarrow import parquet  # imports slowly
    from pyarrow import table as rows

    schema = rows(_narrow(columns, slice(0))).schema
    with whole_file(path) as file, parquet.ParquetWriter(file, schema, compression="zstd") as writer:
        for first in range(0, len(columns["time"]), BLOCK):
            writer.write_table(rows(_narrow(columns, slice(first, first + BLOCK))))


def _narrow(columns: Mapping[str, Array], rows: slice = slice(None)) -> dict[str, NDArray[np.floating]]:
    return {name: values[rows].astype("f8" if name == "time" else "f4") for name, values in columns.items()}


def cut_trial(trial: TrialTable, length: float | None) -> list[TrialTable]:
    """Return the pieces of `length` [s] of a trial, on its clock; a rest of less than half of that is dropped."""
    duration = float(trial.time[-1] - trial.time[0])
    if length is not None and not length * len(trial.time) >= MINIMUM_SAMPLES * duration:
        raise InputError(f"source.length={length:g}: pieces need {MINIMUM_SAMPLES} rows; give more seconds")
    if length is None or duration < 1.5 * length:
        return [trial]
    starts = np.arange(0.0, duration - 0.5 * length, length) + trial.time[0]
    edges = [*np.searchsorted(trial.time, starts - 1e-9), len(trial.time)]
    stem, _, ending = trial.entry.file.rpartition(".")
    pieces = []
    for number, (start, end) in enumerate(pairwise(edges)):
        piece = rows_of(trial, slice(start, end))
        entry = trial.entry.model_copy(update={"file": f"{stem}_part{number:02d}.{ending}"})
        pieces.append(replace(piece, entry=entry))
    return pieces


def require_free(out: Path) -> None:
    """Refuse, by an InputError, a folder that holds something."""
    if (out / DESCRIPTION).exists():
        raise InputError(f"{out}: holds a recording already; choose another folder or remove it")
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"{out}: is there already and not empty; choose another folder or remove it")


def write_recordings(out: Path, parts: Mapping[str, RecordingTables]) -> None:
    """Write recordings (sub-folder -> recording), read them back, say what they hold, and only then name them `out`.

    Raises:
        InputError: what cannot be used; nothing is left behind.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(prefix=f".{out.name}-", dir=out.parent))
    try:
        for name, tables in parts.items():
            if rows := tables.understood:
                widths = [max(len(row[0]) for row in rows), max((len(row[1]) for row in rows if row[2]), default=0)]
                lines = [f"  {what:<{widths[0]}}  {how:<{widths[1]}}  {by}".rstrip() for what, how, by in rows]
                print("\n".join(["columns as interpreted, and why:", *lines]))
            recording = _written(aside / name, tables, out / name)
            seconds = sum(trial.duration for trial in recording.trials)
            kinds = ", ".join(dict.fromkeys(trial.kind for trial in recording.trials))
            count = "1 trial" if len(recording.trials) == 1 else f"{len(recording.trials)} trials"
            print(f"{out / name}: {count} ({kinds}), {seconds:.0f} s, joints {', '.join(recording.joints)}")
        aside.chmod(0o755)
        aside.replace(out)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _written(folder: Path, tables: RecordingTables, place: Path) -> Recording:
    """Write a recording and read it back, without those of its trials that cannot be used, the fewer half at most.

    Messages name the user's files in place of those that were made from them.
    """

    def with_origins(message: str) -> str:
        for table in tables.tables:
            if table.origin is not None:
                message = message.replace(str(folder / table.entry.file), str(table.origin))
        return message.replace(str(folder), str(place))

    left: list[str] = []
    while True:
        write_recording(folder, tables)
        try:
            recording = read_recording(folder)
            break
        except InputError as error:
            said = str(error)
            rest = [table for table in tables.tables if f"{folder / table.entry.file}:" not in said]
            left.append(with_origins(said))
            if len(rest) == len(tables.tables):
                raise InputError(left[-1]) from None
            if len(rest) < len(left):
                raise InputError(left[0]) from None
        doubts = [*tables.description.doubts, f"left out: {left[-1]}"]
        description = tables.description.model_copy(update={"doubts": doubts})
        tables = replace(tables, tables=rest, description=description)
        shutil.rmtree(folder)
    for line in recording.warnings:
        warn(with_origins(line))
    return recording
