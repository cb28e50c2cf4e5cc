"""The columns of a trial's table, found, complete and free of holes."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.tables import Table

Array = NDArray[np.float64]
MINIMUM_SAMPLES = 20
SIGNALS = ("command", "position", "torque")


@dataclass(frozen=True)
class TrialColumns:
    """A trial as written in its file: time (n,) and signals (n, joints); torque is None where it was not measured."""

    time: Array
    command: Array
    position: Array
    torque: Array | None


def pick_columns(table: Table, joints: tuple[str, ...], path: Path) -> tuple[TrialColumns, list[str]]:
    """The named columns of a table, and warnings about what was left aside.

    Raises:
        InputError: a missing column, a trial too short to say anything, or a value that is no finite number.
    """
    warnings = _unknown_columns(table, joints, path)
    _require(table, ["time", *(f"{joint}.{signal}" for joint in joints for signal in SIGNALS[:2])], path)
    _require_length(len(table["time"]), path)
    torque, torque_warnings = _torque(table, joints, path)
    columns = TrialColumns(
        _finite(table, "time", path),
        _stack(table, joints, "command", path),
        _stack(table, joints, "position", path),
        torque,
    )
    return columns, warnings + torque_warnings


def _require(table: Table, names: list[str], path: Path) -> None:
    missing = [name for name in names if name not in table]
    if missing:
        raise InputError(f"{path}: column '{missing[0]}' is missing (missing: {missing}; the file has: {list(table)})")


def _require_length(samples: int, path: Path) -> None:
    if samples < MINIMUM_SAMPLES:
        raise InputError(
            f"{path}: column 'time' has {samples} samples, last row {samples - 1}; a trial needs at least "
            f"{MINIMUM_SAMPLES}: record it again or remove it from recording.yaml"
        )


def _torque(table: Table, joints: tuple[str, ...], path: Path) -> tuple[Array | None, list[str]]:
    names = [f"{joint}.torque" for joint in joints]
    lacking = [name for name in names if name not in table or np.isnan(table[name]).all()]
    if not lacking:
        return _stack(table, joints, "torque", path), []
    if len(lacking) == len(names):
        return None, []
    return None, [f"{path}: column '{lacking[0]}' is missing or empty: torque is not used in this trial"]


def _stack(table: Table, joints: tuple[str, ...], signal: str, path: Path) -> Array:
    return np.stack([_finite(table, f"{joint}.{signal}", path) for joint in joints], axis=1)


def _finite(table: Table, name: str, path: Path) -> Array:
    wrong = np.flatnonzero(~(np.abs(table[name]) <= (np.finfo(float).max if name == "time" else limits.NUMBER)))
    if len(wrong):
        row = int(wrong[0])
        raise InputError(
            f"{path}: column '{name}', row {row}: received {table[name][row]} ({len(wrong)} such rows); "
            "leave out rows that were not measured, the time column then shows the gap"
        )
    return table[name]


def _unknown_columns(table: Table, joints: tuple[str, ...], path: Path) -> list[str]:
    others = {name.rpartition(".")[0] for name in table if name.rpartition(".")[2] in SIGNALS} - set(joints) - {""}
    return [
        f"{path}: columns of '{joint}' are ignored: it is not among joints {list(joints)}" for joint in sorted(others)
    ]
