"""How the tables of another program are read: the unit of each column, and the trial that a table makes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import SIGNALS
from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.rig import RigJoint
from tactile_cube.measurement.recordings.tables import Table
from tactile_cube.measurement.recordings.writing import TrialTable
from tactile_cube.measurement.sources.column_map import ColumnMap
from tactile_cube.measurement.sources.units import (
    FORCE_UNITS,
    TORQUE_UNITS,
    Unit,
    at_the_joint,
    gear_of,
    of_motor,
    position_unit,
    same_unit,
    time_unit,
    torque_unit,
)

Array = NDArray[np.float64]
Row = tuple[str, str, str]
SAID = ("its name", "source.angle_unit", "source.length_unit")
"""What tells a unit for certain."""
OF_SOME = {"link_position": np.nan, "feedforward": 0.0}
"""Signals that some joints may have, and what stands for those of the others."""


@dataclass(frozen=True)
class SaidUnits:
    """Units that the user names; None where the columns are to tell."""

    time: str | None = None
    angle: str | None = None
    length: str | None = None
    torque: str | None = None


@dataclass(frozen=True)
class TableReading:
    """How tables are read.

    Attributes:
        columns: which column is what.
        time: unit of the time stamps, or None where rows follow one another at a fixed rate.
        units: joint -> signal -> unit.
    """

    columns: ColumnMap
    time: Unit | None
    units: dict[str, dict[str, Unit]]

    def rows(self, rate: float) -> Iterator[Row]:
        """What was understood, for people: what, how, and what told it."""
        if self.time is not None:
            yield "time", f"{self.columns.time} [{self.time.name}], {rate:g} Hz", self.time.source
        for joint, entry in self.columns.joints.items():
            for signal, column in entry.items():
                unit = self.units[joint][signal]
                yield f"{joint} {signal}", f"{column} [{unit.name}]", unit.source
        yield "not used", ", ".join(self.columns.unused), ""

    def trial(self, table: Table, path: Path, entry: TrialEntry, rate: float | None) -> TrialTable:
        """The trial in a table; `rate` [Hz] is used where the rows have no time.

        Raises:
            InputError: a column is missing in this table.
        """
        joints = self.columns.joints

        def stacked(signal: str, lacking: float) -> Array:
            none = np.full(len(next(iter(table.values()))), lacking)
            return np.stack(
                [
                    _column(table, entry[signal], path) * self.units[joint][signal].size if signal in entry else none
                    for joint, entry in joints.items()
                ],
                axis=1,
            )

        every = [s for s in ("command", "position", "torque") if all(s in entry for entry in joints.values())]
        some = [s for s in OF_SOME if any(s in entry for entry in joints.values())]
        values = {signal: stacked(signal, OF_SOME.get(signal, 0.0)) for signal in every + some}
        time = np.arange(len(values["position"])) / (rate or 1.0)
        if self.time is not None and self.columns.time is not None:
            time = _column(table, self.columns.time, path)
            time = (time - time[0]) * self.time.size
        return TrialTable(entry, time, origin=path, **values)


def understand(
    tables: Mapping[Path, Table],
    columns: ColumnMap,
    joints: Mapping[str, RigJoint],
    said: SaidUnits,
    torque_mode: bool,
) -> TableReading:
    """The units of all columns, told by the values of all tables together.

    Raises:
        InputError: a column is missing in a table, or no such unit.
    """

    def values(name: str) -> Array:
        return np.concatenate([_column(table, name, path) for path, table in tables.items()])

    units: dict[str, dict[str, Unit]] = {}
    for joint, entry in columns.joints.items():
        if joint not in joints:
            raise InputError(f"source.columns.{joint}: no such joint in the URDF; it has {', '.join(joints)}")
        rig_joint = joints[joint]
        own = said.length if rig_joint.prismatic else said.angle
        units[joint] = {
            signal: torque_unit(said.torque, entry[signal], rig_joint.prismatic)
            if signal in ("torque", "feedforward") or (torque_mode and signal == "command")
            else position_unit(own, entry[signal], values(entry[signal]), rig_joint)
            for signal in entry
        }
        if not torque_mode and own is None:
            _make_alike(units[joint], values(entry["command"]), values(entry["position"]))
        if "link_position" in entry:
            _count_at_the_joint(units[joint], {signal: values(column) for signal, column in entry.items()}, entry)
    first = next(iter(tables.items()))
    time = (
        None if columns.time is None else time_unit(said.time, columns.time, _column(first[1], columns.time, first[0]))
    )
    return TableReading(columns, time, units)


def _make_alike(units: dict[str, Unit], command: Array, position: Array) -> None:
    spread = float(np.ptp(command))
    if spread > 0:
        ratio = float(np.ptp(position)) / spread
        units["command"], units["position"] = same_unit(units["command"], units["position"], ratio)


def _count_at_the_joint(units: dict[str, Unit], logged: Mapping[str, Array], columns: Mapping[str, str]) -> None:
    """Angles of a geared motor as angles of its joint, and what is logged beside it on the motor's side likewise."""
    torques = [s for s in units if units[s].name in {*TORQUE_UNITS, *FORCE_UNITS}]
    # no joint's limits tell the unit of a motor's angle; its link's is the best guess
    told = {s: units[s if units[s].source in SAID else "link_position"] for s in units if s not in torques}
    motor, command, link = (logged[s] * told.get(s, units[s]).size for s in ("position", "command", "link_position"))
    if (gear := gear_of(motor, link)) == 1.0:
        return
    units["position"] = at_the_joint(told["position"], gear)
    if "command" in told and (of_motor(columns["command"]) or np.ptp(command) > np.sqrt(abs(gear)) * np.ptp(link)):
        units["command"] = at_the_joint(told["command"], gear)
    for signal in torques:
        if of_motor(columns[signal]):
            units[signal] = at_the_joint(units[signal], gear)


def _column(table: Table, name: str, path: Path) -> Array:
    if name not in table:
        raise InputError(f"{path}: column '{name}' is missing; the columns of numbers are {list(table)}")
    return table[name]


def cut_trial(trial: TrialTable, length: float | None) -> Sequence[TrialTable]:
    """Pieces of `length` [s] of a trial; a rest of less than half of that is dropped."""
    duration = float(trial.time[-1] - trial.time[0])
    if length is None or duration < 1.5 * length:
        return [trial]
    starts = np.arange(0.0, duration - 0.5 * length, length) + trial.time[0]
    edges = [*np.searchsorted(trial.time, starts - 1e-9), len(trial.time)]
    return [_piece(trial, k, slice(edges[k], edges[k + 1])) for k in range(len(starts))]


def _piece(trial: TrialTable, number: int, rows: slice) -> TrialTable:
    stem, _, ending = trial.entry.file.rpartition(".")
    entry = trial.entry.model_copy(update={"file": f"{stem}_part{number:02d}.{ending}"})
    signals = {signal: getattr(trial, signal) for signal in SIGNALS}
    parts: dict[str, Any] = {signal: None if one is None else one[rows] for signal, one in signals.items()}
    return replace(trial, entry=entry, time=trial.time[rows] - trial.time[rows.start], **parts)
