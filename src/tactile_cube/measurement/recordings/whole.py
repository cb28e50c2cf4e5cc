"""A recording written whole or not at all: made and read beside its place, then moved there."""

import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import DESCRIPTION, read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import RecordingTables, write_recording


def require_free(out: Path) -> None:
    """Refuse a folder that holds something.

    Raises:
        InputError: it does.
    """
    if (out / DESCRIPTION).exists():
        raise InputError(f"out={out}: holds a recording already; choose another folder or remove it")
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"out={out}: is there already and not empty; choose another folder or remove it")


def write_whole(out: Path, parts: Mapping[str, RecordingTables]) -> None:
    """Write recordings (sub-folder -> recording), read them back, say what they hold, and only then name them `out`.

    Raises:
        InputError: what cannot be used; nothing is left behind.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(prefix=f".{out.name}-", dir=out.parent))
    try:
        for name, tables in parts.items():
            _say_understood(tables.understood)
            write_recording(aside / name, tables)
            _say_content(out / name, _read_back(aside / name, tables, out / name))
        aside.chmod(0o755)
        aside.replace(out)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _read_back(folder: Path, tables: RecordingTables, place: Path) -> Recording:
    try:
        recording = read_recording(folder)
    except InputError as error:
        raise InputError(_with_origins(str(error), folder, tables, place)) from None
    for line in recording.warnings:
        print(f"warning: {_with_origins(line, folder, tables, place)}", file=sys.stderr)
    return recording


def _with_origins(message: str, folder: Path, tables: RecordingTables, place: Path) -> str:
    """The message with the user's files in place of those that were made from them."""
    for table in tables.tables:
        if table.origin is not None:
            message = message.replace(str(folder / table.entry.file), str(table.origin))
    return message.replace(str(folder), str(place))


def _say_understood(rows: Sequence[tuple[str, str, str]]) -> None:
    if rows:
        widths = [max(len(row[k]) for row in rows) for k in (0, 1)]
        lines = [f"  {what:<{widths[0]}}  {how:<{widths[1]}}  {by}".rstrip() for what, how, by in rows]
        print("\n".join(["understood, and what told it:", *lines]))


def _say_content(place: Path, recording: Recording) -> None:
    seconds = sum(trial.duration for trial in recording.trials)
    kinds = ", ".join(dict.fromkeys(trial.kind for trial in recording.trials))
    count = "1 trial" if len(recording.trials) == 1 else f"{len(recording.trials)} trials"
    print(f"{place}: {count} ({kinds}), {seconds:.0f} s, joints {', '.join(recording.joints)}")
