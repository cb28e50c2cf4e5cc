"""Columns of numbers from a trial's file: Parquet, CSV or NPZ."""

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars
from numpy.typing import NDArray

from tactile_cube.errors import InputError

Table = dict[str, NDArray[np.float64]]


def read_table(path: Path) -> Table:
    """Column name -> values, all of one length.

    Raises:
        InputError: a missing or truncated file, an unknown ending, or a column that holds no numbers.
    """
    readers: dict[str, Callable[[Path], Table]] = {".parquet": _parquet, ".csv": _csv, ".npz": _npz}
    if path.suffix.lower() not in readers:
        raise InputError(f"{path}: unknown ending '{path.suffix}'; trials are {', '.join(readers)}")
    if not path.is_file():
        raise InputError(f"{path}: no such file; recording.yaml names it under 'trials'")
    table = readers[path.suffix.lower()](path)
    if len({len(column) for column in table.values()}) > 1:
        lengths = {name: len(column) for name, column in table.items()}
        raise InputError(f"{path}: columns differ in length: {lengths}")
    return table


def _parquet(path: Path) -> Table:
    try:
        frame = polars.read_parquet(path)
    except (polars.exceptions.PolarsError, OSError) as error:
        raise InputError(f"{path}: not a complete Parquet file (truncated?): {_first_line(error)}") from None
    return _numbers(frame, path)


def _csv(path: Path) -> Table:
    try:
        frame = polars.read_csv(path, infer_schema_length=None, comment_prefix="#")
    except (polars.exceptions.PolarsError, OSError) as error:
        raise InputError(f"{path}: not a CSV table: {_first_line(error)}") from None
    return _numbers(frame.rename({name: name.strip() for name in frame.columns}), path)


def _npz(path: Path) -> Table:
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: _one_dimension(archive[name], name, path) for name in archive.files}
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not a complete NPZ file of plain arrays: {_first_line(error)}") from None


def _one_dimension(array: NDArray[np.generic], name: str, path: Path) -> NDArray[np.float64]:
    if array.ndim != 1 or array.dtype.kind not in "fiu":
        raise InputError(
            f"{path}: column '{name}' is {array.ndim}-dimensional {array.dtype}, expected (samples,) numbers"
        )
    return array.astype(np.float64)


def _numbers(frame: polars.DataFrame, path: Path) -> Table:
    table: Table = {}
    for name in frame.columns:
        column = frame[name]
        if column.dtype == polars.String:
            parsed = column.str.strip_chars().cast(polars.Float64, strict=False)
            wrong = (parsed.is_null() & column.is_not_null() & (column.str.strip_chars() != "")).arg_true()
            if len(wrong):
                row = int(wrong[0])
                raise InputError(f"{path}: column '{name}', row {row}: expected a number, received '{column[row]}'")
            column = parsed
        if not (column.dtype.is_numeric() or column.dtype == polars.Null):
            raise InputError(f"{path}: column '{name}' holds {column.dtype}, expected numbers")
        table[name] = column.cast(polars.Float64).fill_null(float("nan")).to_numpy().astype(np.float64)
    return table


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0] or type(error).__name__
