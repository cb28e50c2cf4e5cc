"""NPZ files of plain arrays, whose sizes are known before any of them is read."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.untrusted_file import regular

HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def read_npz(path: Path, most: int = limits.NUMBERS) -> dict[str, NDArray[Any]]:
    """Return all arrays of an NPZ file.

    Args:
        path: of the file.
        most: numbers of 8 bytes that its arrays may have together.

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
    """Name and bytes of each array, by its header."""
    for member in archive.namelist():
        with archive.open(member) as stream:
            shape, _, dtype = HEADERS[np.lib.format.read_magic(stream)](stream)
        if min(shape, default=0) < 0 or not member.endswith(".npy"):
            raise ValueError(f"member '{member}' is no array")
        yield member.removesuffix(".npy"), math.prod(shape) * max(1, dtype.itemsize)


def _array(archive: ZipFile, member: str) -> NDArray[Any]:
    with archive.open(member) as stream:
        return np.asarray(np.lib.format.read_array(stream, allow_pickle=False))
