"""Files that are there whole or not at all, whatever happens while they are written."""

import contextlib
import io
import json
import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO


def write_whole(path: Path, *parts: bytes | memoryview) -> None:
    """Write parts, one after the other, aside, bring them to the disk, then name the file; its mode follows the umask.

    Raises:
        OSError: as of `whole_file`.
    """
    with whole_file(path) as file:
        for part in parts:
            file.write(part)


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """Give a file to write into, which gets its name once all is written: for what is too large for the memory.

    Raises:
        OSError: it cannot be written, with `path` as its file; a file of that name stays as it was.
    """
    partial = path.with_name(f"{path.name}.partial")
    try:
        partial.unlink(missing_ok=True)  # one left behind, or a link to elsewhere
        with partial.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except BaseException as error:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
        if isinstance(error, OSError):  # a full disk does not say which file it had no room for
            raise OSError(error.errno, error.strerror or str(error), str(path)) from error
        raise
    sync_folder(path.parent)


def write_json(path: Path, data: Any) -> None:
    """Write plain data; raises as `write_whole`."""
    write_whole(path, json.dumps(data, indent=1).encode())


def write_npz(path: Path, arrays: Mapping[str, Any], compressed: bool = True) -> None:
    """Write arrays as one NumPy archive; raises as `write_whole`."""
    import numpy as np  # slow, and --help does without

    content = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(content, allow_pickle=False, **arrays)
    write_whole(path, content.getvalue())


@contextlib.contextmanager
def written_together(folder: Path, index: str) -> Iterator[Path]:
    """Give a folder to write into, whose files appear in `folder` when all are written; `index` appears last.

    While the names change, a few system calls, there is no index: where there is one, all files are of one writing. The
    folder is made if it is not there; its other files stay.

    Raises:
        OSError: what the body raises, and then `folder` stays as it was; or a name that something else has.
    """
    folder.mkdir(parents=True, exist_ok=True)
    aside = folder / ".partial"
    shutil.rmtree(aside, ignore_errors=True)  # one left behind
    try:
        aside.mkdir()
        yield aside
        files = [path.relative_to(aside) for path in aside.rglob("*") if path.is_file()]
        for place in (folder / file for file in files):
            place.parent.mkdir(parents=True, exist_ok=True)
        (folder / index).unlink(missing_ok=True)
        for file in sorted(files, key=lambda one: one == Path(index)):
            (aside / file).replace(folder / file)
        sync_folder(folder)
    except OSError as error:
        error.filename = str(error.filename or folder).replace(str(aside), str(folder), 1)
        raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk, where the system can."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(folder)) from error
    finally:
        os.close(handle)
