"""Files from elsewhere: where they may lie, that they are regular files, and how large they may be."""

import math
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from tactile_cube import limits
from tactile_cube.errors import InputError

LONGEST_POINTER = 1000  # bytes
KINDS = (("a folder", stat.S_ISDIR), ("a pipe", stat.S_ISFIFO), ("a socket", stat.S_ISSOCK))


def below(folder: Path, name: str, where: str, root: Path | None = None) -> Path:
    """Return the place of a file that another file names, relative to `folder`; there may be nothing there.

    It must lie below `root` (None: `folder`) once all links are followed. An error begins with `where`: the other file,
    and the key in it.

    Raises:
        InputError: it lies elsewhere.
    """
    path, root = folder / name.removeprefix("file://"), root or folder
    try:
        inside = path.resolve().is_relative_to(root.resolve())
    except (OSError, RuntimeError, ValueError) as error:  # a loop of links, a NUL
        raise InputError(f"{where}: '{name}' is no name of a file: {error}") from None
    if not inside:
        raise InputError(f"{where}: '{name}' lies outside of {root}; put the file into that folder")
    return path


def regular(path: Path, most: int = limits.TABLE, lacking: str = "") -> Path:
    """Return `path` if it is a file of `most` bytes that can be read to its end.

    Raises:
        InputError: there is none (with `lacking` after it), it is a folder, a pipe or a device, or too large.
    """
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: no such file{lacking}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not stat.S_ISREG(status.st_mode):
        kind = next((name for name, holds in KINDS if holds(status.st_mode)), "a device")
        raise InputError(f"{path}: is {kind}; a regular file is needed here")
    if status.st_size > most:
        raise InputError(f"{path}: has {status.st_size / 1e6:.4g} MB; up to {most / 1e6:g} MB are read here")
    if status.st_size < LONGEST_POINTER and path.read_bytes().startswith(b"version https://git-lfs"):
        raise InputError(f"{path}: only points to the file in Git LFS; fetch it: git lfs pull")
    return path


def read_text(path: Path, lacking: str = "") -> str:
    """Return the text of a file. Raises InputError: as `regular`, or it is no UTF-8."""
    try:
        return regular(path, limits.TEXT, lacking).read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is no text in UTF-8: {error.reason} at byte {error.start}") from None


def read_npz(path: Path, most: int = limits.NUMBERS) -> dict[str, NDArray[Any]]:
    """Return all arrays of an NPZ file, of `most` numbers of 8 bytes together.

    Raises:
        InputError: there is no such file, it is no complete NPZ file of plain arrays, or claims to hold too much.
    """
    regular(path)
    try:
        with ZipFile(path) as archive:
            sizes = dict(_sizes(archive))
            if len(archive.namelist()) > min(len(sizes), limits.COLUMNS):
                raise InputError(f"{path}: has an array twice, or more than {limits.COLUMNS}; write it again")
            if sum(sizes.values()) > 8 * most:
                name, size = max(sizes.items(), key=lambda one: one[1])
                raise InputError(
                    f"{path}: claims {sum(sizes.values()) / 1e6:.4g} MB, {size / 1e6:.4g} of them for '{name}'; "
                    f"{8e-6 * most:g} MB are read here: leave something out"
                )
            return {name: _array(archive, f"{name}.npy") for name in sizes}
    except InputError:
        raise
    except Exception as error:  # zipfile, zlib and NumPy raise a dozen kinds for damaged files
        reason = str(error).strip().partition("\n")[0] or type(error).__name__
        raise InputError(f"{path}: not a complete NPZ file of plain arrays: {reason}") from None


def _sizes(archive: ZipFile) -> Iterator[tuple[str, int]]:
    for member in archive.namelist():
        with archive.open(member) as stream:
            if np.lib.format.read_magic(stream) != (1, 0):  # others may have gigabytes of header
                raise ValueError(f"member '{member}' has a header that no plain array needs")
            shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
        if min(shape, default=0) < 0 or not member.endswith(".npy"):
            raise ValueError(f"member '{member}' is no array")
        yield member.removesuffix(".npy"), math.prod(shape) * max(1, dtype.itemsize)


def _array(archive: ZipFile, member: str) -> NDArray[Any]:
    with archive.open(member) as stream:
        return np.asarray(np.lib.format.read_array(stream, allow_pickle=False))
