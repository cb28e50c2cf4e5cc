"""Columns of numbers from a trial's file: Parquet, CSV or NPZ."""

import re
import zipfile
from collections.abc import Callable
from itertools import islice
from pathlib import Path

import numpy as np
import polars
from numpy.typing import NDArray

from tactile_cube.errors import InputError

Table = dict[str, NDArray[np.float64]]


def read_table(path: Path, only_numbers: bool = True) -> Table:
    """Column name -> values, all of one length.

    Args:
        path: Parquet, CSV (separated by comma, semicolon or tab) or NPZ.
        only_numbers: refuse columns that hold something else; otherwise they are left out, and dates become seconds.

    Raises:
        InputError: a missing or truncated file, an unknown ending, or a column that holds no numbers.
    """
    frames: dict[str, Callable[[Path], polars.DataFrame]] = {".parquet": _parquet, ".csv": _csv, ".txt": _csv}
    suffix = path.suffix.lower()
    if suffix not in {*frames, ".npz"}:
        raise InputError(f"{path}: unknown ending '{path.suffix}'; trials are .parquet, .csv, .txt, .npz")
    if not path.is_file():
        raise InputError(f"{path}: no such file; recording.yaml names it under 'trials'")
    if suffix == ".npz":
        table = _npz(path)
    else:
        frame = frames[suffix](path)
        table = _numbers(frame if only_numbers else _without_words(frame), path)
    if len({len(column) for column in table.values()}) > 1:
        lengths = {name: len(column) for name, column in table.items()}
        raise InputError(f"{path}: columns differ in length: {lengths}")
    return table


def _parquet(path: Path) -> polars.DataFrame:
    try:
        return polars.read_parquet(path)
    except (polars.exceptions.PolarsError, polars.exceptions.PanicException, OSError) as error:
        raise InputError(f"{path}: not a complete Parquet file (truncated?): {_first_line(error)}") from None


def _csv(path: Path) -> polars.DataFrame:
    try:
        separator, decimal_comma = _dialect(path)
        frame = polars.read_csv(
            path,
            infer_schema_length=None,
            comment_prefix="#",
            separator=separator,
            decimal_comma=decimal_comma,
            encoding="utf8-lossy",
        )
    except (polars.exceptions.PolarsError, polars.exceptions.PanicException, OSError) as error:
        raise InputError(f"{path}: not a CSV table: {_first_line(error)}") from None
    return frame.rename({name: name.strip().strip("\ufeff") for name in frame.columns})


def _dialect(path: Path) -> tuple[str, bool]:
    """Separator, and whether numbers have a decimal comma, from the header and the row below it."""
    with path.open(encoding="utf-8", errors="replace") as stream:
        lines = [line for line in islice(stream, 50) if line.strip() and not line.startswith("#")]
    header, row = [*lines, "", ""][:2]
    separator = max(",;\t", key=header.count)
    return separator, separator != "," and re.search(r"\d,\d", row) is not None


def _without_words(frame: polars.DataFrame) -> polars.DataFrame:
    """Columns of numbers, and dates as seconds."""
    kept = []
    for column in frame:
        if column.dtype == polars.String:
            numbers = column.str.strip_chars().cast(polars.Float64, strict=False)
            column = numbers if numbers.is_not_null().any() else _date(column)
        if column.dtype.is_temporal():
            column = column.cast(polars.Datetime("us")).cast(polars.Int64) * 1e-6
        if column.dtype.is_numeric():
            kept.append(column)
    return polars.DataFrame(kept)


def _date(column: polars.Series) -> polars.Series:
    try:
        return column.str.to_datetime(time_unit="us", time_zone="UTC", strict=True)
    except polars.exceptions.PolarsError:
        return column


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


def _first_line(error: BaseException) -> str:
    return str(error).strip().partition("\n")[0] or type(error).__name__
