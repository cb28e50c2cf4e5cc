"""A log of another program as columns, whatever its file: CSV, Parquet, NPZ, MATLAB, JSON, a LeRobot data set."""

import json
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import polars
from numpy.typing import NDArray

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.tables import CSV, Table, read_frame, unknown_ending
from tactile_cube.measurement.sources.column_map import time_of
from tactile_cube.untrusted_file import below, read_npz, read_text, regular

Step = tuple[str, str]
"""What was done to a log, and the details."""
WIDEST = 64  # columns that a list is expanded to; more are pictures
PERIODS = {"dt": 1.0, "rate": -1.0, "fps": -1.0, "sample_rate": -1.0}
"""Names of a constant that states the time step or rate, and its exponent in the time step."""
LEROBOT = Path("meta", "info.json")
"""What a LeRobot data set says of its columns, in its folder."""
MISSING = ("", "nan", "na", "n/a", "null", "none", "-")
CLOCK = r"^\s*(?:(\d+):)?(\d+):(\d+(?:[.,]\d+)?)\s*$"
DAY, YEAR = 86400.0, 3.15e7  # [s]; dates count from 1970


@dataclass(frozen=True)
class Log:
    """What a file holds: columns (n,) by name."""

    path: Path
    table: Table  # of numbers, nan where there is none
    texts: Mapping[str, NDArray[Any]] = field(default_factory=dict)  # of words
    wrong: Mapping[str, tuple[int, str]] = field(default_factory=dict)  # row and text of the first word among numbers
    units: Mapping[str, str] = field(default_factory=dict)  # as a row of units says
    steps: tuple[Step, ...] = ()
    name: str = ""  # of the trial
    whole: str = ""  # name of the log that the trial was cut from

    def rows(self, rows: NDArray[Any], *steps: Step, name: str | None = None) -> "Log":
        """Return these rows of it alone (a mask or indices)."""
        parts = ({column: values[rows] for column, values in part.items()} for part in (self.table, self.texts))
        table, texts = parts
        return replace(self, table=table, texts=texts, steps=(*self.steps, *steps), name=name or self.name)


def read_logs(path: Path) -> list[Log]:
    """Read the logs in a file, or those of a LeRobot data set in a folder.

    Raises:
        InputError: a missing, truncated or too large file, or one of an unknown format.
    """
    if path.is_dir():
        if not (path / LEROBOT).is_file():
            raise InputError(f"{path}: a folder, and no LeRobot data set (no meta/info.json); name its files: {path}/*")
        files = [below(path, str(one.relative_to(path)), str(path)) for one in path.glob("data/**/*.parquet")]
        if not files:
            raise InputError(f"{path}: a LeRobot data set without data/**/*.parquet; fetch its data")
        return [read_logs(file)[0] for file in sorted(files)]
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise unknown_ending(path, f"{', '.join(READERS)}, or the folder of a LeRobot data set")
    return [replace(READERS[suffix](regular(path)), name=path.stem)]


def _frame_log(path: Path) -> Log:
    frame, dialect = read_frame(path)
    names = _lerobot_names(path)
    columns: dict[str, Any] = {}
    steps: list[Step] = []
    if dialect is not None and dialect.preamble:
        steps.append(("preamble", f"{dialect.preamble} lines above the header are left out"))
    if dialect is not None and dialect.units:
        steps.append(("row of units", ", ".join(f"{name} [{unit}]" for name, unit in dialect.units.items())))
    if dialect is not None and dialect.encoding != "utf-8-sig":
        steps.append(("encoding", dialect.encoding))
    for name in frame.columns:
        column = frame[name]
        if isinstance(column.dtype, polars.List | polars.Array):
            expanded, said = _expanded(name, _stacked(column), names.get(name, ()))
            columns |= expanded
            steps.append(("list column", said))
        else:
            columns[name] = column
    return _log(path, columns, steps, dialect.units if dialect is not None else {})


def _stacked(column: polars.Series) -> NDArray[Any]:
    """Return lists of numbers as (n, width); of no width where they differ in length or hold something else."""
    column = column.cast(polars.List(polars.Float64), strict=False) if column.dtype.is_nested() else column
    widths = column.list.len().drop_nulls().unique()
    if len(widths) != 1 or column.null_count():
        return np.zeros((len(column), 0))
    return np.asarray(column.list.explode().to_numpy(), dtype=np.float64).reshape(len(column), int(widths[0]))


def _expanded(name: str, values: NDArray[Any], names: Sequence[str] = ()) -> tuple[dict[str, NDArray[Any]], str]:
    """Return columns `name[0]`, `name[1]` ... or `name.NAME` of a table (n, width), and what to say of them."""
    width = values.shape[1]
    if not 0 < width <= WIDEST:
        return {}, f"{name}: not up to {WIDEST} numbers a row, left out"
    named = [f"{name}.{one}" for one in names] if len(names) == width else [f"{name}[{k}]" for k in range(width)]
    return {one: np.array(column) for one, column in zip(named, values.T, strict=True)}, f"{named[0]} .. {named[-1]}"


def _log(path: Path, columns: Mapping[str, Any], steps: list[Step], units: Mapping[str, str]) -> Log:
    """Tell numbers, dates, times of day [s] and words apart."""
    table: Table = {}
    texts: dict[str, NDArray[Any]] = {}
    wrong: dict[str, tuple[int, str]] = {}
    clocks = []
    for name, values in columns.items():
        column = polars.Series(name, values)
        if column.dtype == polars.String:
            told = column.str.strip_chars()
            column = _told(told)
            clocks += [name] if column.dtype == polars.Duration else []
            words_in = (column.is_null() & ~told.str.to_lowercase().is_in(MISSING)).arg_true()
            wrong |= {name: (int(words_in[0]), told[int(words_in[0])])} if len(words_in) else {}
        if column.dtype.is_temporal():
            column = column if name in clocks else column.cast(polars.Datetime("us"))
            column = column.cast(polars.Int64) * 1e-6
        if column.dtype.is_numeric() or column.dtype in (polars.Boolean, polars.Null):
            table[name] = column.cast(polars.Float64).fill_null(float("nan")).to_numpy()
        elif column.dtype == polars.String:
            texts[name] = column.to_numpy()
    for name in clocks:
        days = [other for other, one in table.items() if not (one % DAY).any() and (one > YEAR).all()]
        midnights = DAY * np.cumsum(np.diff(table[name], prepend=table[name][0]) < -DAY / 2)
        table[name] = table[name] + (table[days[0]] - table[days[0]][0] if days else midnights)
        steps.append(("time of day", f"{name} in seconds" + (f", with the date in {days[0]}" if days else "")))
    if texts:
        steps.append(("words", f"{', '.join(texts)}: no numbers, left out"))
    if not any(map(len, table.values())):
        raise InputError(f"{path}: has no rows of numbers; its columns are {list(columns)}")
    return Log(path, table, texts, wrong, units, tuple(steps))


def _told(column: polars.Series) -> polars.Series:
    """Return text as numbers, times of day (a duration) or dates where it is that."""
    if len(column) and column.str.contains(CLOCK).all():
        parts = [column.str.extract(CLOCK, group).str.replace(",", ".").cast(polars.Float64) for group in (1, 2, 3)]
        seconds = parts[0].fill_null(0.0) * 3600.0 + parts[1] * 60.0 + parts[2]
        return (seconds * 1e6).round().cast(polars.Int64, strict=False).cast(polars.Duration("us"))
    numbers = column.cast(polars.Float64, strict=False)
    if numbers.is_not_null().any():
        return numbers
    try:
        return column.str.to_datetime(time_unit="us", time_zone="UTC", strict=True)
    except polars.exceptions.PolarsError:
        return column


def _arrays_log(path: Path, arrays: Mapping[str, NDArray[Any]]) -> Log:
    """Return arrays with one row a sample: `(n,)`, `(n, width)` or `(width, n)`; a constant may say the time step."""
    squeezed = {name: np.squeeze(array) for name, array in arrays.items()}
    numbers = {name: one for name, one in squeezed.items() if one.dtype.kind in "fiub"}
    flat = {name: len(one) for name, one in numbers.items() if one.ndim == 1}
    time = time_of(list(flat))
    rows = flat[time] if time else max((max(one.shape) for one in numbers.values() if one.ndim), default=0)
    columns: dict[str, NDArray[Any]] = {}
    steps: list[Step] = []
    for name, one in squeezed.items():
        if one.dtype.kind not in "fiub" or one.ndim not in (1, 2) or rows not in one.shape:
            if one.ndim:
                steps.append(("left out", f"{name}: {'x'.join(map(str, one.shape))} {one.dtype}"))
        elif one.ndim == 1:
            columns[name] = one
        else:
            expanded, said = _expanded(name, one if one.shape[0] == rows else one.T)
            columns |= expanded
            steps.append(("array", f"{'x'.join(map(str, one.shape))}: {said}"))
    constants = {name: float(one) for name, one in numbers.items() if not one.ndim}
    if constants:
        steps.append(("constants", ", ".join(f"{name} {value:g}" for name, value in constants.items())))
    period = next((constants[name] ** power for name, power in PERIODS.items() if constants.get(name, 0.0) > 0), None)
    if time is None and period is not None and rows:
        columns = {"time": np.arange(rows) * period} | columns
        steps.append(("time", f"rows are {period:g} s apart, as a constant of the file says"))
    return _log(path, columns, steps, {})


def _mat(path: Path) -> Log:
    from scipy.io import loadmat  # imports slowly

    with path.open("rb") as stream:
        if stream.read(8) == b"MATLAB 7":
            raise InputError(f"{path}: a MATLAB file of version 7.3; write it by save(..., '-v7')")
    _require_small(path)
    try:
        arrays = loadmat(path, struct_as_record=False, squeeze_me=True, chars_as_strings=True)
    except Exception as error:  # the reader raises a dozen kinds for damaged files
        raise InputError(f"{path}: not a complete MATLAB file: {str(error) or type(error).__name__}") from None
    own = {name: one for name, one in arrays.items() if not name.startswith("__")}
    return _arrays_log(path, dict(_flat(own if len(own) > 1 else next(iter(own.values()), {}))))


def _require_small(path: Path) -> None:
    left, content = 8 * limits.NUMBERS, path.read_bytes()
    order: Literal["little", "big"] = "little" if content[126:128] == b"IM" else "big"
    place = 128
    while place + 8 <= len(content) and left >= 0:
        kind, size = (int.from_bytes(content[place + k : place + k + 4], order) for k in (0, 4))
        unpack, rest = zlib.decompressobj(), content[place + 8 : place + 8 + size] if kind == 15 else b""
        left -= 0 if rest else size
        while rest and left >= 0:
            try:
                left -= len(unpack.decompress(rest, 1 << 24))
            except zlib.error as error:
                raise InputError(f"{path}: not a complete MATLAB file: {error}") from None
            rest = unpack.unconsumed_tail
        place += 8 + size
    if left < 0:
        raise InputError(f"{path}: unpacks to more than {8e-6 * limits.NUMBERS:g} MB; leave something out")


def _json(path: Path) -> Log:
    regular(path, limits.CHUNK)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        arrays = dict(_flat(data if isinstance(data, dict) else {"rows": data}))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: no JSON of rows or columns: {error}") from None
    if not any(array.ndim for array in arrays.values()):
        raise InputError(f"{path}: no list of rows and no lists of numbers in it; keys are {list(arrays)[:8]}")
    return _arrays_log(path, arrays)


def _flat(data: Any, prefix: str = "") -> Iterator[tuple[str, NDArray[Any]]]:
    """Return arrays of nested objects, named by their path; columns of a list of objects have none."""
    if hasattr(data, "_fieldnames"):
        data = {name: getattr(data, name) for name in data._fieldnames}
    if isinstance(data, list) and data and all(isinstance(row, dict) for row in data):
        rows = [dict(_scalars(row)) for row in data]
        data, prefix = {name: [row.get(name) for row in rows] for name in dict.fromkeys(k for r in rows for k in r)}, ""
    if isinstance(data, dict):
        for name, one in data.items():
            yield from _flat(one, f"{prefix}.{name}".strip("."))
        return
    try:
        array = np.array(data if not isinstance(data, list) else [np.nan if one is None else one for one in data])
    except ValueError:  # lists that differ in length
        return
    if array.dtype.kind in "fiubUS":
        yield prefix, array


def _scalars(row: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, one in row.items():
        yield from _scalars(one, f"{prefix}{name}.") if isinstance(one, dict) else [(f"{prefix}{name}", one)]


def _lerobot_names(path: Path) -> dict[str, list[str]]:
    places = [path.parent, *path.parents[2:3]]
    info = next((place / LEROBOT for place in places if (place / LEROBOT).is_file()), None)
    if info is None or path.suffix.lower() != ".parquet":
        return {}
    try:
        features = json.loads(read_text(info))["features"]
        named = {name: feature.get("names") for name, feature in features.items()}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{info}: not the description of a LeRobot data set: {error!r}") from None
    lists = {name: next(iter(one.values()), None) if isinstance(one, dict) else one for name, one in named.items()}
    return {name: [str(one) for one in names] for name, names in lists.items() if isinstance(names, list)}


READERS: Mapping[str, Callable[[Path], Log]] = {
    **dict.fromkeys(CSV, _frame_log),
    ".parquet": _frame_log,
    ".npz": lambda file: _arrays_log(file, read_npz(file)),
    ".mat": _mat,
    ".json": _json,
}
"""Ending of a file that may be a log -> what reads it."""
