"""Columns of numbers from a trial's file: Parquet, NPZ, or CSV of any separator, encoding and header."""

import codecs
import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars
from numpy.typing import NDArray

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.untrusted_file import read_npz, regular

NUMBER = re.compile(r"[-+]?[\d.,]+([eE][-+]?\d+)?")
VALUE = re.compile(r"[-+]?\d[\d.,:/ T-]*([eE][-+]?\d+)?Z?|[-+]?(nan|inf)", re.IGNORECASE)
PACKED = (b"\x1f\x8b", b"\x28\xb5\x2f\xfd", b"\x78\x01", b"\x78\x5e", b"\x78\x9c", b"\x78\xda")
"""First bytes of gzip, zstd and zlib files, which the CSV reader would unpack without a limit."""
LOOKED_AT = 100  # lines
ALIKE = 5  # rows below a header that must have as many fields
UNIT = 12  # letters of a unit at most


@dataclass(frozen=True)
class Dialect:
    """How a CSV file is written."""

    separator: str  # of fields
    decimal_comma: bool  # whether numbers have one
    names: list[str]  # of the columns
    units: dict[str, str]  # column -> unit, of a row of units below the header
    header: int  # lines down to and with the header and its units
    preamble: int  # lines of text above the header
    encoding: str  # of the text


def dialect_of(path: Path) -> Dialect:
    """Detect the dialect of the CSV file at `path`.

    Raises:
        InputError: it is compressed, has too long a line, no column names, or blanks between its columns.
    """
    with path.open("rb") as stream:
        start = [stream.readline(limits.LINE) for _ in range(LOOKED_AT)]
    if start[0].startswith(PACKED):
        raise InputError(f"{path}: is compressed; unpack it")
    if any(len(line) == limits.LINE for line in start):
        raise InputError(f"{path}: not a CSV table: a line is longer than {limits.LINE / 1e6:g} MB")
    encoding = _encoding(b"".join(start))
    text = [line.strip() for line in b"".join(start).decode(encoding, errors="replace").split("\n")]
    lines = [k for k, line in enumerate(text) if line and not line.startswith("#")]
    fields = {separator: [_fields(text[k], separator) for k in lines] for separator in ",;\t"}
    found = {separator: place for separator, rows in fields.items() if (place := _header(rows)) is not None}
    if not found:
        return _without_header(path, text, lines, encoding)
    separator = max(found, key=lambda one: len(fields[one][found[one][0]]))
    header, data = found[separator]
    names = fields[separator][header]
    below = dict(zip(names, fields[separator][header + 1], strict=True)) if data > header + 1 else {}
    units = {name: unit for name, unit in below.items() if unit.strip(" -")}
    comma = _decimal_comma(separator, [text[k] for k in lines[header:]])
    return Dialect(separator, comma, names, units, lines[data - 1] + 1, header, encoding)


def _encoding(start: bytes) -> str:
    """Return UTF-8, or UTF-16 by its first bytes, or else Windows' western one, in which degrees are the byte 0xB0."""
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(start)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _fields(line: str, separator: str) -> list[str]:
    try:
        fields = next(csv.reader(line.splitlines()[:1], delimiter=separator), [])
    except csv.Error:  # 130 kB without this separator: another one may stand in the line
        return []
    return [field.strip().strip("\ufeff") for field in fields]


def _header(rows: Sequence[list[str]]) -> tuple[int, int] | None:
    """Find the first row of words alone and the row of as many numbers below it; a row of units may lie between."""
    for k, names in enumerate(rows[:-1]):
        if len(names) < 2 or not any(names) or any(VALUE.fullmatch(name) for name in names):
            continue
        for data in (k + 1, k + 2):
            below, units = rows[data : data + ALIKE], rows[k + 1 : data]
            alike = all(len(row) == len(names) and any(map(VALUE.fullmatch, row)) for row in below)
            if below and alike and all(len(row) == len(names) and max(map(len, row)) <= UNIT for row in units):
                return k, data
    return None


def _without_header(path: Path, text: list[str], lines: list[int], encoding: str) -> Dialect:
    """Take the first line as header, or the comment above it if that line has numbers."""
    first = text[lines[0]] if lines else ""
    separator = max(",;\t", key=first.count)
    if separator not in first and len(first.split()) > 1:
        raise InputError(f"{path}: its columns are separated by blanks; separate them by comma, semicolon or tab")
    names, header = _fields(first, separator), lines[0] + 1 if lines else 0
    if NUMBER.fullmatch(first.partition(separator)[0].strip()):
        above = [line.strip("#" + separator + " ") for line in text[: text.index(first)] if line]
        named = [_fields(line, separator) for line in reversed(above) if line.count(separator) + 1 == len(names)]
        if not named:
            raise InputError(f"{path}: its first line has numbers, '{first[:40]}'; write the columns' names above it")
        names, header = named[0], lines[0]
    return Dialect(separator, _decimal_comma(separator, [text[k] for k in lines]), names, {}, header, 0, encoding)


def _decimal_comma(separator: str, rows: Sequence[str]) -> bool:
    return separator != "," and any(re.search(r"\d,\d", row) for row in rows)


Table = dict[str, NDArray[np.float64]]
CSV = (".csv", ".txt", ".tsv")
SAVE_AS_CSV = "save it as CSV there (File, Save as)"
ADVICE = {
    ".xlsx": SAVE_AS_CSV, ".xls": SAVE_AS_CSV, ".ods": SAVE_AS_CSV,
    ".bag": "convert it to MCAP and use record source=mcap", ".db3": "convert it to MCAP and use record source=mcap",
    ".mcap": "use record source=mcap", ".h5": "write its arrays as NPZ", ".hdf5": "write its arrays as NPZ",
    ".pkl": "is a program and not read; write its arrays as NPZ", ".npy": "write its columns as CSV or NPZ",
}  # fmt: skip
"""Advice on file types that are not read."""


def unknown_ending(path: Path, known: str) -> InputError:
    """Return the error for a file with an unknown ending, with advice."""
    advice = ADVICE.get(path.suffix.lower())
    return InputError(f"{path}: unknown ending '{path.suffix}'; {advice or f'trials are {known}'}")


def read_table(path: Path, most: int = limits.NUMBERS) -> Table:
    """Read column name -> values, all of one length, of a Parquet, CSV or NPZ file of at most `most` numbers.

    Raises:
        InputError: a missing, truncated or too large file, an unknown ending, or a column that holds no numbers.
    """
    suffix = path.suffix.lower()
    if suffix not in (".parquet", ".npz", *CSV):
        raise unknown_ending(path, f".parquet, {', '.join(CSV)}, .npz")
    regular(path, lacking="; recording.yaml names it under 'trials'")
    if suffix == ".npz":
        arrays = read_npz(path, most)
        for name, one in arrays.items():
            if one.ndim != 1 or one.dtype.kind not in "fiu":
                raise InputError(
                    f"{path}: column '{name}' is {one.ndim}-dimensional {one.dtype}, expected (samples,) numbers"
                )
        table = {name: np.asarray(array, dtype=np.float64) for name, array in arrays.items()}
    else:
        frame, dialect = read_frame(path, most)
        if dialect is not None and dialect.units:
            raise InputError(f"{path}: has a row of units below its header, {dialect.units}; delete it")
        table = _numbers(frame, path)
    if len({len(column) for column in table.values()}) > 1:
        lengths = {name: len(column) for name, column in table.items()}
        raise InputError(f"{path}: columns differ in length: {lengths}")
    return table


def read_frame(path: Path, most: int = limits.NUMBERS) -> tuple[polars.DataFrame, Dialect | None]:
    """Read a Parquet or CSV file, whatever its columns hold, and return also the dialect of a CSV file.

    Raises:
        InputError: a truncated or too large file.
    """
    suffix = path.suffix.lower()
    try:
        return (_parquet(path, most), None) if suffix == ".parquet" else _csv(path, most)
    except (polars.exceptions.PolarsError, polars.exceptions.PanicException, OSError) as error:
        reason = str(error).strip().partition("\n")[0] or type(error).__name__
        raise InputError(f"{path}: not a complete {suffix} file (truncated?): {reason}") from None


def _parquet(path: Path, most: int) -> polars.DataFrame:
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
    read = [name for name, kind in schema.items() if kind not in (polars.Binary, polars.Struct)]
    return frame.select(read).collect()


def _csv(path: Path, most: int) -> tuple[polars.DataFrame, Dialect]:
    dialect = dialect_of(path)
    with path.open("rb") as stream:
        rows = sum(block.count(b"\n") for block in iter(lambda: stream.read(1 << 20), b""))
    _require_size(path, rows * len(dialect.names), len(dialect.names), most)
    utf8 = dialect.encoding == "utf-8-sig"
    frame = polars.read_csv(
        path if utf8 else io.BytesIO(path.read_bytes().decode(dialect.encoding, "replace").encode()),
        glob=False, infer_schema_length=None, comment_prefix="#", separator=dialect.separator, has_header=False,
        decimal_comma=dialect.decimal_comma, encoding="utf8-lossy", skip_lines=dialect.header,
    )  # fmt: skip
    names = [*dialect.names, *frame.columns[len(dialect.names) :]]
    once = [name if name not in names[:k] else f"{name}_{k}" for k, name in enumerate(names)]
    return frame.rename(dict(zip(frame.columns, once, strict=False))), dialect


def _require_size(path: Path, numbers: int, columns: int, most: int) -> None:
    if numbers > most or columns > limits.COLUMNS:
        raise InputError(
            f"{path}: holds {columns} columns, {numbers:.4g} numbers; {limits.COLUMNS} columns and {most:.4g} numbers "
            "are read here: leave columns out, or split the trial"
        )


def _numbers(frame: polars.DataFrame, path: Path) -> Table:
    table: Table = {}
    for name in frame.columns:
        column = frame[name]
        if column.dtype == polars.String:
            parsed = column.str.strip_chars().cast(polars.Float64, strict=False)
            wrong = (parsed.is_null() & column.is_not_null() & (column.str.strip_chars() != "")).arg_true()
            if len(wrong):
                row = int(wrong[0])
                raise InputError(f"{path}: column '{name}', row {row}: expected a number, not '{column[row]}'")
            column = parsed
        if not (column.dtype.is_numeric() or column.dtype == polars.Null):
            raise InputError(f"{path}: column '{name}' holds {column.dtype}, expected numbers")
        table[name] = column.cast(polars.Float64).fill_null(float("nan")).to_numpy()
    return table
