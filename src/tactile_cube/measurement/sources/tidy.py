"""Cut logs into trials: topics, files, episodes, equal rows, gaps, torque switched off."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import LONGEST_GAP, MINIMUM_SAMPLES
from tactile_cube.measurement.recordings.tables import Table
from tactile_cube.measurement.sources.column_map import ColumnMap, time_of
from tactile_cube.measurement.sources.log_file import Log
from tactile_cube.measurement.sources.units import words

Mask = NDArray[np.bool_]
EPISODE = frozenset({"episode", "trial", "run", "segment"})
COUNTED = frozenset({"index", "id", "idx", "no", "nr", "number"})
SWITCH = frozenset({"enable", "enabled"})
TOPICS, ALTERNATING = 64, 0.1  # kinds of rows at most, and share of the rows after which another kind follows
OVERLAP = 0.5  # share of the shorter one's time that files of one trial have in common
RESTART = 1.0  # [s] back in time of a log whose topics may come late
MOST_LOST = 0.1  # share of the rows in pieces that are too short
HELD = ("command", "feedforward")


def apart(log: Log) -> Log:
    """Put topics that share the rows of a log, named in a column of words, in columns of their own."""
    for name, texts in log.texts.items():
        kinds = sorted({str(text) for text in texts if text is not None})
        changes = np.count_nonzero(texts[1:] != texts[:-1])
        if not (1 < len(kinds) <= TOPICS and changes > ALTERNATING * len(texts)):
            continue
        time = time_of(list(log.table))
        values = [column for column in log.table if column != time]
        table: Table = {time: log.table[time]} if time is not None else {}
        for kind in kinds:
            here = texts == kind
            for column in values:
                if np.isfinite(log.table[column][here]).any():
                    plain = kind if len(values) == 1 else f"{kind}.{column}"
                    table[plain] = np.where(here, log.table[column], np.nan)
        return replace(log, table=table, steps=(*log.steps, ("topics", f"of '{name}': {', '.join(kinds)}")))
    return log


def joined(logs: Sequence[Log], whole: Callable[[Sequence[str]], bool]) -> list[Log]:
    """Join logs of one trial in files of their own, where one file alone has not all that is needed."""
    if len(logs) < 2 or whole(list(logs[0].table)):
        return list(logs)
    groups: list[list[Log]] = []
    for log in logs:
        home = next((group for group in groups if all(_beside(one, log) for one in group)), None)
        groups.append([log]) if home is None else home.append(log)
    return [_merged(group) if len(group) > 1 else group[0] for group in groups]


def _beside(one: Log, other: Log) -> bool:
    shared = set(one.table) & set(other.table)
    time = time_of(list(one.table))
    if time is None or shared != {time}:
        return False
    (a, b), (c, d) = ((np.nanmin(log.table[time]), np.nanmax(log.table[time])) for log in (one, other))
    return bool(min(b, d) - max(a, c) > OVERLAP * min(b - a, d - c))


def _merged(logs: Sequence[Log]) -> Log:
    name = str(time_of(list(logs[0].table)))
    times = [log.table[name] for log in logs]
    half = 0.5 * np.median(np.diff(times[0]))  # a period: within it are the stamps of two files of one loop
    alike = all(len(one) == len(times[0]) and np.abs(one - times[0]).max() < half for one in times)
    time = times[0] if alike else np.unique(np.concatenate(times))
    table: Table = {name: time}
    for log in logs:
        rows = np.arange(len(time)) if alike else np.searchsorted(time, log.table[name])
        for column in log.table:
            if column != name:
                table[column] = np.full(len(time), np.nan)
                table[column][rows] = log.table[column]
    wrong = {column: one for log in logs for column, one in log.wrong.items()}
    units = {column: one for log in logs for column, one in log.units.items()}
    files = " + ".join(log.path.name for log in logs) + (", row by row" if alike else "")
    steps = (*(step for log in logs for step in log.steps), ("files of one time", files))
    return Log(logs[0].path, table, {}, wrong, units, steps, logs[0].name)


def without_equal_rows(log: Log, columns: ColumnMap) -> Log:
    """Return the log without rows that are equal to the row before them, time included."""
    if columns.time is None or len(log.table[columns.time]) < 2:
        return log
    used = np.stack([log.table[name] for name in columns.names if name in log.table], axis=1)
    equal = ((used[1:] == used[:-1]) | (np.isnan(used[1:]) & np.isnan(used[:-1]))).all(axis=1)
    if not equal.any():
        return log
    step = ("equal rows", f"{np.count_nonzero(equal)} of {len(used)} rows repeat the row before and are left out")
    return log.rows(np.concatenate([[True], ~equal]), step)


def trials_of(log: Log, columns: ColumnMap, second: float, free: bool) -> list[Log]:
    """Cut a log without equal rows into trials: at episodes, restarts and gaps of time, and where torque is switched.

    Args:
        log: of one file.
        columns: which are used.
        second: size of the unit of time [s].
        free: keep the trials without torque, and not those with it.

    Raises:
        InputError: too many rows lie in pieces that are too short.
    """
    if columns.time is None:
        return [log]
    name = columns.time
    sparse = any(np.isnan(log.table[one]).any() for one in _measured(log, columns))
    labels, how = _episodes(log)
    restarts = _restarts(log, columns, second, labels, RESTART if sparse else 0.0)
    whole = [_on_one_time(piece, columns) for piece in _cut(log, restarts, labels, how)]
    trials = [trial for piece in whole for trial in _gaps_out(piece, columns, second, free)]
    kept = [trial for trial in trials if len(trial.table[name]) >= MINIMUM_SAMPLES]
    lost = sum(len(trial.table[name]) for trial in trials) - sum(len(trial.table[name]) for trial in kept)
    if not kept or lost > MOST_LOST * sum(len(piece.table[name]) for piece in whole):
        longest = max((len(trial.table[name]) for trial in trials), default=0)
        raise InputError(
            f"{log.path}: column '{name}': cut at gaps of {LONGEST_GAP:g} s, at restarts and where torque is switched, "
            f"{lost} rows are in pieces of less than {MINIMUM_SAMPLES}, the longest of {longest}"
        )
    if lost:
        kept[0] = replace(kept[0], steps=(*kept[0].steps, ("short pieces", f"{lost} rows are left out")))
    return kept


def _restarts(log: Log, columns: ColumnMap, second: float, labels: Sequence[str], most: float) -> Mask:
    """Find where time goes back by more than `most` [s] to its start (n - 1,); raise InputError for disorder."""
    time = log.table[str(columns.time)] * second
    steps = np.diff(time)
    back = (steps < -most) & ~_differ(labels, len(steps))
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    begun = time[0]
    for row in np.flatnonzero(back) + 1:
        after = steps[row : row + MINIMUM_SAMPLES - 1]
        if time[row] > begun + 2.0 * usual or not ((after >= -most) & (after <= max(LONGEST_GAP, 2.0 * usual))).all():
            raise InputError(
                f"{log.path}: column '{columns.time}', row {row}: time runs backwards, from {time[row - 1]:.6g} s to "
                f"{time[row]:.6g} s; sort the rows or split the trial"
            )
        begun = time[row]
    return back


def _measured(log: Log, columns: ColumnMap) -> list[str]:
    return [name for name in columns.names if name in log.table and not np.isnan(log.table[name]).all()]


def _cut(log: Log, boundary: Mask, labels: Sequence[str] = (), what: str = "", kind: str = "part") -> Iterator[Log]:
    """Return the pieces of a log between boundaries (n - 1,), which are named by their labels (n,) or else numbered."""
    edges = [0, *(np.flatnonzero(boundary | _differ(labels, len(boundary))) + 1), len(boundary) + 1]
    for number in range(len(edges) - 1):
        rows = np.arange(edges[number], edges[number + 1])
        label = f"{kind}{number:02d}" if not len(labels) else f"episode{labels[edges[number]]}"
        steps = (("cut", f"{log.name}: {len(edges) - 1} pieces{what}"),) if len(edges) > 2 and not number else ()
        yield log.rows(rows, *steps, name=f"{log.name}_{label}" if len(edges) > 2 else None)


def _differ(labels: Sequence[str], count: int) -> Mask:
    return np.array([a != b for a, b in pairwise(labels)] or [False] * count, dtype=bool)


def _episodes(log: Log) -> tuple[Sequence[str], str]:
    for name in (*log.table, *log.texts):
        said = set(words(name))
        if not (said & EPISODE and said <= EPISODE | COUNTED):
            continue
        values = log.table[name] if name in log.table else log.texts[name]
        labels = [f"{value:g}" if name in log.table else str(value) for value in values]
        if 0 < np.count_nonzero(_differ(labels, len(labels) - 1)) < len(labels) / MINIMUM_SAMPLES:
            return labels, f", one where '{name}' changes"
    return (), ", where time starts again"


def _on_one_time(log: Log, columns: ColumnMap) -> Log:
    """Return signals that come in rows of their own at the times of the first joint's positions.

    A command is held from its last row; what is measured is interpolated.
    """
    sparse = [name for name in _measured(log, columns) if np.isnan(log.table[name]).any()]
    if columns.time is None or not sparse:
        return log
    log = log.rows(np.argsort(log.table[columns.time], kind="stable"))
    time, base = log.table[columns.time], next(iter(columns.joints.values()))["position"]
    rows = np.isfinite(log.table[base]) & np.isfinite(time)
    held = {entry[signal] for entry in columns.joints.values() for signal in HELD if signal in entry}
    made = log.rows(rows).table
    for name in sparse:
        values, has = log.table[name], np.isfinite(log.table[name]) & np.isfinite(time)
        if name in held:
            last = np.searchsorted(time[has], time[rows], side="right") - 1
            made[name] = np.where(last >= 0, values[has][np.maximum(last, 0)], np.nan)
        elif name != base:
            made[name] = np.interp(time[rows], time[has], values[has], left=np.nan, right=np.nan)
    known = np.logical_and.reduce([np.isfinite(made[name]) for name in _measured(log, columns)])
    how = f"{np.count_nonzero(known)} rows at the times of '{base}'; commands are held, readings interpolated"
    return replace(log.rows(rows), table=made).rows(known, ("rows of their own", f"{', '.join(sparse)}: {how}"))


def _gaps_out(log: Log, columns: ColumnMap, second: float, free: bool) -> Iterator[Log]:
    steps = np.diff(log.table[str(columns.time)]) * second
    far = steps > LONGEST_GAP if len(steps) and np.median(steps) <= LONGEST_GAP else np.zeros(len(steps), dtype=bool)
    switches = [
        values > 0.5
        for name, values in log.table.items()
        if SWITCH & set(words(name)) and name not in columns.names and set(np.unique(values)) == {0.0, 1.0}
    ]
    on = np.logical_and.reduce(switches) if switches else None
    wanted = np.ones(len(steps) + 1, dtype=bool) if on is None else on != free
    if on is not None and not wanted.all():
        other = "with" if free else "without"
        hint = "" if free else "; source.controller.mode=free imports those instead"
        off = f"{np.count_nonzero(~wanted)} of {len(wanted)} rows of {log.name} are {other} torque and left out{hint}"
        log = replace(log, steps=(*log.steps, ("torque off", off)))
    longest = f", at gaps of up to {steps[far].max():.3g} s" if far.any() else ""
    marks = log.rows(np.arange(len(wanted)))
    marks = replace(marks, table={**marks.table, "": wanted.astype(np.float64)})
    for piece in _cut(marks, far | (wanted[1:] != wanted[:-1]), (), longest):
        if piece.table.pop("").all():
            yield piece
