"""Columns of numbers from a trial's file: Parquet, CSV or NPZ."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import polars
import polars.selectors as selectors
from numpy.typing import NDArray

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.untrusted_file import read_npz, regular

Table = dict[str, NDArray[np.float64]]
Reader = Callable[[Path, int, bool], Table]
PACKED = (b"\x1f\x8b", b"\x28\xb5\x2f\xfd", b"\x78\x01", b"\x78\x5e", b"\x78\x9c", b"\x78\xda")
"""How gzip, zstd and zlib begin, which the reader of CSV would unpack whatever comes of it."""


NUMBER = re.compile(r"[-+]?[\d.,]+([eE][-+]?\d+)?")


def read_table(path: Path, most: int = limits.NUMBERS, only_numbers: bool = True) -> Table:
    """Column name -> values, all of one length.

    Args:
        path: Parquet, CSV (separated by comma, semicolon or tab) or NPZ.
        most: numbers that it may hold; what it says of its size is looked at before it is read.
        only_numbers: refuse columns that hold something else; otherwise they are left out, and dates become seconds.

    Raises:
        InputError: a missing, truncated or too large file, an unknown ending, or a column that holds no numbers.
    """
    readers: dict[str, Reader] = {".parquet": _parquet, ".csv": _csv, ".txt": _csv, ".npz": _npz}
    suffix = path.suffix.lower()
    if suffix not in readers:
        raise InputError(f"{path}: unknown ending '{path.suffix}'; trials are {', '.join(readers)}")
    regular(path, lacking="; recording.yaml names it under 'trials'")
    try:
        table = readers[suffix](path, most, only_numbers)
    except (polars.exceptions.PolarsError, polars.exceptions.PanicException, OSError) as error:
        reason = str(error).strip().partition("\n")[0] or type(error).__name__
        raise InputError(f"{path}: not a complete {suffix} file (truncated?): {reason}") from None
    if len({len(column) for column in table.values()}) > 1:
        lengths = {name: len(column) for name, column in table.items()}
        raise InputError(f"{path}: columns differ in length: {lengths}")
    return table


def _parquet(path: Path, most: int, only_numbers: bool) -> Table:
    from pyarrow import ArrowException, parquet  # imports slowly

    try:
        about = parquet.read_metadata(path)
        groups = [about.row_group(index) for index in range(about.num_row_groups)]
    except ArrowException as error:
        raise OSError(error) from None
    frame = polars.scan_parquet(path, glob=False, hive_partitioning=False)
    schema = frame.collect_schema()
    numbers = sum(max(abs(group.num_rows) * len(schema), group.total_byte_size // 16) for group in groups)
    _require_size(path, numbers, len(schema), most)
    plain = [name for name, kind in schema.items() if kind.is_numeric() or kind == polars.Null]
    dates = [] if only_numbers else [name for name, kind in schema.items() if kind.is_temporal()]
    wrong = [name for name in schema if only_numbers and name not in plain]
    if wrong:
        raise InputError(f"{path}: column '{wrong[0]}' holds {schema[wrong[0]]}, expected numbers")
    return _numbers(_in_seconds(frame.select(*plain, *dates).collect()), path)


def _csv(path: Path, most: int, only_numbers: bool) -> Table:
    frame = _csv_frame(path, most)
    return _numbers(frame if only_numbers else _without_words(frame), path)


def _csv_frame(path: Path, most: int) -> polars.DataFrame:
    separator, decimal_comma, names, columns = _dialect(path)
    with path.open("rb") as stream:
        rows = sum(block.count(b"\n") for block in iter(lambda: stream.read(1 << 20), b""))
    _require_size(path, rows * columns, columns, most)
    frame = polars.read_csv(
        path, glob=False, infer_schema_length=None, comment_prefix="#", separator=separator,
        decimal_comma=decimal_comma, encoding="utf8-lossy", has_header=names is None, new_columns=names,
    )  # fmt: skip
    return frame.rename({name: name.strip().strip("\ufeff") for name in frame.columns})


def refuse_words(path: Path, names: Sequence[str]) -> None:
    """Name the first word in columns of a CSV file that hold numbers beside it.

    Raises:
        InputError: there is one.
    """
    if path.suffix.lower() in (".csv", ".txt"):
        _numbers(_csv_frame(path, limits.NUMBERS).select(names), path)


def _npz(path: Path, most: int, only_numbers: bool) -> Table:
    table = read_npz(path, most)
    for name, array in table.items():
        if array.ndim != 1 or array.dtype.kind not in "fiu":
            raise InputError(
                f"{path}: column '{name}' is {array.ndim}-dimensional {array.dtype}, expected (samples,) numbers"
            )
    return {name: np.asarray(array, dtype=np.float64) for name, array in table.items()}


def _require_size(path: Path, numbers: int, columns: int, most: int) -> None:
    if numbers > most or columns > limits.COLUMNS:
        raise InputError(
            f"{path}: holds {columns} columns, {numbers:.4g} numbers; {limits.COLUMNS} columns and {most:.4g} numbers "
            "are read here: leave columns out, or split the trial"
        )


def _dialect(path: Path) -> tuple[str, bool, list[str] | None, int]:
    """Separator, whether numbers have a decimal comma, names that stand in a comment, and the number of columns."""
    with path.open("rb") as stream:
        start = [stream.readline(limits.LINE) for _ in range(50)]
    if start[0].startswith(PACKED):
        raise InputError(f"{path}: is compressed; unpack it")
    if any(len(line) == limits.LINE for line in start):
        raise InputError(f"{path}: not a CSV table: a line is longer than {limits.LINE / 1e6:g} MB")
    text = [line.decode(errors="replace").strip() for line in start]
    first, *rows = [*(line for line in text if line and not line.startswith("#")), ""]
    separator = max(",;\t", key=first.count)
    if separator not in first and len(first.split()) > 1:
        raise InputError(f"{path}: its columns are separated by blanks; separate them by comma, semicolon or tab")
    columns, names = first.count(separator) + 1, None
    if NUMBER.fullmatch(first.partition(separator)[0].strip()):
        comments = [line.strip("#" + separator + " ").split(separator) for line in text[: text.index(first)] if line]
        names = next(([name.strip() for name in one] for one in reversed(comments) if len(one) == columns), None)
        if names is None:
            raise InputError(f"{path}: its first line has numbers, '{first[:40]}'; write the columns' names above it")
    decimal_comma = separator != "," and any(re.search(r"\d,\d", row) for row in (first, *rows))
    return separator, decimal_comma, names, columns


def _without_words(frame: polars.DataFrame) -> polars.DataFrame:
    """Columns of numbers, and dates as seconds."""
    kept = []
    for column in frame:
        if column.dtype == polars.String:
            numbers = column.str.strip_chars().cast(polars.Float64, strict=False)
            column = numbers if numbers.is_not_null().any() else _date(column)
        kept.append(column)
    return _in_seconds(polars.DataFrame(kept).select(selectors.numeric() | selectors.temporal()))


def _in_seconds(frame: polars.DataFrame) -> polars.DataFrame:
    """Dates as seconds."""
    return frame.with_columns(selectors.temporal().cast(polars.Datetime("us")).cast(polars.Int64) * 1e-6)


def _date(column: polars.Series) -> polars.Series:
    try:
        return column.str.to_datetime(time_unit="us", time_zone="UTC", strict=True)
    except polars.exceptions.PolarsError:
        return column


def _numbers(frame: polars.DataFrame, path: Path) -> Table:
    table: Table = {}
    for name in frame.columns:
        column = frame[name]
        if column.dtype == polars.String:
            parsed = column.str.strip_chars().cast(polars.Float64, strict=False)
            wrong = (parsed.is_null() & column.is_not_null() & (column.str.strip_chars() != "")).arg_true()
            if len(wrong):
                row = int(wrong[0])
                units = "; is that a row of units? Write them into the names and delete it" if row == 0 else ""
                raise InputError(f"{path}: column '{name}', row {row}: expected a number, not '{column[row]}'{units}")
            column = parsed
        if not (column.dtype.is_numeric() or column.dtype == polars.Null):
            raise InputError(f"{path}: column '{name}' holds {column.dtype}, expected numbers")
        table[name] = column.cast(polars.Float64).fill_null(float("nan")).to_numpy()
    return table
