"""Archives of published data sets."""

from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError


def open_archive(path: Path) -> dict[str, NDArray[Any]]:
    """All arrays of an NPZ file of plain arrays.

    Raises:
        InputError: no such file, or no complete archive.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except FileNotFoundError:
        raise InputError(f"source.file={path}: no such file") from None
    except (OSError, ValueError, BadZipFile) as error:
        raise InputError(f"source.file={path}: not a complete NPZ file: {error}") from None
