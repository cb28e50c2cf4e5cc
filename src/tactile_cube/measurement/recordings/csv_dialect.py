"""How a CSV file is written: encoding, preamble, header, row of units, separator, decimal comma."""

import codecs
import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tactile_cube import limits
from tactile_cube.errors import InputError

NUMBER = re.compile(r"[-+]?[\d.,]+([eE][-+]?\d+)?")
VALUE = re.compile(r"[-+]?\d[\d.,:/ T-]*([eE][-+]?\d+)?Z?|[-+]?(nan|inf)", re.IGNORECASE)
PACKED = (b"\x1f\x8b", b"\x28\xb5\x2f\xfd", b"\x78\x01", b"\x78\x5e", b"\x78\x9c", b"\x78\xda")
"""How gzip, zstd and zlib begin, which the reader of CSV would unpack whatever comes of it."""
LOOKED_AT = 100  # lines
ALIKE = 5  # rows below a header that must have as many fields
UNIT = 12  # letters of a unit at most


@dataclass(frozen=True)
class Dialect:
    """How a CSV file is written.

    Attributes:
        separator: of fields.
        decimal_comma: whether numbers have one.
        names: of the columns.
        units: column -> unit, of a row of units below the header.
        header: lines down to and with the header and its units.
        preamble: lines of text above the header.
        encoding: of the text.
    """

    separator: str
    decimal_comma: bool
    names: list[str]
    units: dict[str, str]
    header: int
    preamble: int
    encoding: str


def dialect_of(path: Path) -> Dialect:
    """How the CSV file at `path` is written.

    Raises:
        InputError: it is compressed, has lines without end, no names of columns, or blanks between its columns.
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
    """UTF-8, or UTF-16 by its first bytes, or else Windows' western one, in which degrees are the byte 0xB0."""
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(start)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _fields(line: str, separator: str) -> list[str]:
    fields = next(csv.reader(line.splitlines()[:1], delimiter=separator), [])
    return [field.strip().strip("\ufeff") for field in fields]


def _header(rows: Sequence[list[str]]) -> tuple[int, int] | None:
    """The first row of words alone, and that of the numbers, as many, below it; units may stand in between."""
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
    """The first line is the header, or else the names stand in a comment above it."""
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
