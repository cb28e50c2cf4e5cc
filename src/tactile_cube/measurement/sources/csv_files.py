"""Tables of another program (CSV, Parquet or NPZ) as a recording; what is not said of them is guessed, and told."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from glob import glob
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.comparing.noise_floor import lag_between
from tactile_cube.measurement.recordings.columns import SIGNALS
from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.rig import Rig, RigJoint, read_rig
from tactile_cube.measurement.recordings.tables import Table, read_table, refuse_words
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, cut_trial
from tactile_cube.measurement.sources.column_map import ColumnMap, map_columns
from tactile_cube.measurement.sources.source import described, rate_of, with_stated
from tactile_cube.measurement.sources.units import Unit, geared, position_unit, same_unit, time_unit, torque_unit

Array = NDArray[np.float64]
Value = TypeVar("Value")
Units = dict[str, dict[str, Unit]]
"""Joint -> signal -> unit."""
OF_SOME = {"link_position": np.nan, "feedforward": 0.0}
"""Signals that some joints may have, and what stands for those of the others."""


@dataclass(frozen=True)
class CsvFiles:
    """Imports tables; conf/source/csv.yaml says what each setting means, and its units."""

    files: Iterable[str]
    urdf: str
    controller: Mapping[str, float | str | None]
    columns: Mapping[str, str | Mapping[str, str]] | None = None
    nominal: Mapping[str, float | None] = field(default_factory=dict)
    gravity: Iterable[float] = (0.0, 0.0, -9.81)
    rate: float | None = None
    angle_unit: str | int | None = None
    length_unit: str | None = None
    time_unit: str | None = None
    torque_unit: str | None = None
    gear: float | None = None
    read: str = "after"
    resolution: float = 0.0
    length: float | None = None
    initialisation: Iterable[int] | None = None
    kind: Iterable[str] | None = None

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """One recording of all files."""
        torque_mode = self.controller.get("mode") == "torque"
        paths, rig = self._paths(), read_rig(Path(self.urdf))
        tables = {path: read_table(path, only_numbers=False) for path in paths}
        columns = self._columns(tables[paths[0]], paths[0], rig, torque_mode)
        if self.gear is not None and not (self.gear and any("link_position" in one for one in columns.joints.values())):
            raise InputError(
                f"source.gear={self.gear:g}: give turns, not 0, and log both the motor's and the link's angle"
            )
        for path, table in tables.items():
            refuse_words(path, [name for name in columns.names if np.isnan(table.get(name, 0.0)).any()])
        units = self._units(tables, columns, rig.joints, torque_mode)
        stamps = None
        if columns.time is not None:
            stamps = time_unit(self.time_unit, columns.time, _column(tables[paths[0]], columns.time, paths[0]))
        starts = _one_each(self.initialisation, paths, "initialisation", [0] * len(paths))
        trials = [
            self._trial(path, table, columns, units, stamps, f"trials/{name}.parquet", start)
            for (path, table), name, start in zip(tables.items(), _distinct(paths), starts, strict=True)
        ]
        rate = self.rate if self.rate is not None else rate_of(trials[0].time, 3, str(paths[0]))
        guessed = kinds_of([path.stem for path in paths], [trial.command for trial in trials], 1 / rate)
        kinds = _one_each(self.kind, paths, "kind", guessed)
        joints = list(columns.joints)
        description = described(
            gravity=list(self.gravity), rate_hz=rate, joints=joints, controller=self._controller(rig, joints),
            nominal=with_stated(self.nominal, rig.nominal, joints),
            sensors={"read": self.read, "position_resolution": self.resolution},
        )  # fmt: skip
        pieces = []
        for trial, kind in zip(trials, kinds, strict=True):
            entry = trial.entry.model_copy(update={"kind": kind})
            pieces += cut_trial(replace(trial, entry=entry), self.length)
        by = "source.kind" if self.kind is not None else "file names and commands"
        count = Counter(kinds)
        repeats = ", ".join(f"{kind} x {n}" if n > 1 else kind for kind, n in count.items())
        understood = [*_rows(columns, units, stamps, rate), ("kinds", repeats, by), *rig.understood(joints)]
        return {"": RecordingTables(description, rig.text, pieces, [row for row in understood if row[1]])}

    def _units(
        self, tables: Mapping[Path, Table], columns: ColumnMap, joints: Mapping[str, RigJoint], torque_mode: bool
    ) -> Units:
        """The units of the signals, told by the values of all tables together."""
        units: Units = {}
        for name, entry in columns.joints.items():
            if name not in joints:
                raise InputError(f"source.columns.{name}: no such joint in the URDF; it has {', '.join(joints)}")
            joint, found = joints[name], units.setdefault(name, {})
            said = self.length_unit if joint.prismatic else self.angle_unit
            values = {s: np.concatenate([_column(t, c, p) for p, t in tables.items()]) for s, c in entry.items()}
            for signal, column in entry.items():
                if signal in ("torque", "feedforward") or (torque_mode and signal == "command"):
                    found[signal] = torque_unit(self.torque_unit, column, joint.prismatic)
                else:
                    found[signal] = position_unit(said, column, values[signal], joint)
            spread = float(np.ptp(values["command"]))
            if not torque_mode and spread > 0:
                ratio = float(np.ptp(values["position"])) / spread
                found["command"], found["position"] = same_unit(found["command"], found["position"], ratio)
            if "link_position" in entry:
                found |= geared(found, values, entry, self.gear)
        return units

    def _trial(
        self, path: Path, table: Table, columns: ColumnMap, units: Units, stamps: Unit | None, file: str, start: int
    ) -> TrialTable:
        values: dict[str, Array] = {}
        for signal in SIGNALS:
            has = [signal in entry for entry in columns.joints.values()]
            if all(has) or (any(has) and signal in OF_SOME):
                lacking = np.full(len(next(iter(table.values()))), OF_SOME.get(signal, 0.0))
                one = [
                    units[joint][signal].of(_column(table, c[signal], path)) if signal in c else lacking
                    for joint, c in columns.joints.items()
                ]
                values[signal] = np.stack(one, axis=1)
        if stamps is not None and columns.time is not None:
            time = _column(table, columns.time, path)
            time = (time - time[0]) * stamps.size
        else:
            time = np.arange(len(values["position"])) / (self.rate or 1.0)
        entry = TrialEntry(file=file, initialisation=start, note=f"from {path.name}")
        return TrialTable(entry, time, origin=path, **values)

    def _controller(self, rig: Rig, joints: list[str]) -> dict[str, Any]:
        said = with_stated(self.controller, rig.gains, joints)
        missing = [f"source.controller.{key}" for key in ("kp", "kd") if key not in said]
        if missing and said.get("mode", "position") == "position":
            raise InputError(
                f"source=csv needs {' and '.join(missing)}: the gains of the position controller that moved the rig "
                "[N m/rad, N m s/rad]; or source.controller.mode=torque where the commands are torques"
            )
        return said

    def _columns(self, table: Table, path: Path, rig: Rig, torque_mode: bool) -> ColumnMap:
        joints = [name for name, joint in rig.joints.items() if joint.mimics is None]
        try:
            columns = map_columns(list(table), joints, self.columns or {}, torque_mode)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        if columns.time is None and self.rate is None:
            raise InputError(
                f"{path}: no column of time among {list(table)}; say 'source.columns={{time: COLUMN, ...}}', or "
                "source.rate=HZ where rows follow one another at a fixed rate"
            )
        return columns

    def _paths(self) -> list[Path]:
        if isinstance(self.files, str):
            raise InputError(f"source.files={self.files}: expected a list: 'source.files=[{self.files}]'")
        found = []
        for pattern in self.files:
            matches = [Path(name) for name in sorted(glob(pattern, recursive=True))]
            if not matches:
                raise InputError(f"source.files: {pattern} matches no file{_beside(Path(pattern))}")
            found += matches
        if not found:
            raise InputError("source.files: no file given")
        return list(dict.fromkeys(found))


def _rows(columns: ColumnMap, units: Units, stamps: Unit | None, rate: float) -> Iterator[tuple[str, str, str]]:
    """What was understood, for people: what, how, and what told it."""
    if stamps is not None:
        yield "time", f"{columns.time} [{stamps.name}], {rate:g} Hz", stamps.source
    for joint, entry in columns.joints.items():
        for signal, column in entry.items():
            yield f"{joint} {signal}", f"{column} [{units[joint][signal].name}]", units[joint][signal].source
    yield "not used", ", ".join(columns.unused), ""


def _column(table: Table, name: str, path: Path) -> Array:
    if name not in table:
        raise InputError(f"{path}: column '{name}' is missing; the columns of numbers are {list(table)}")
    return table[name]


def _beside(pattern: Path) -> str:
    """What there is where a pattern looks."""
    folder = pattern.parent
    if not folder.is_dir():
        return f"; there is no folder {folder}" if "*" not in str(folder) else ""
    names = sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))
    return f"; {folder} has {', '.join(names[:8]) or 'nothing'}{', ...' if len(names) > 8 else ''}"


def _distinct(paths: list[Path]) -> list[str]:
    """A name for each file; files of one name in several folders have the folder's before theirs."""
    count = Counter(path.stem for path in paths)
    names = [path.stem if count[path.stem] == 1 else f"{path.parent.name}_{path.stem}" for path in paths]
    return [name if names.count(name) == 1 else f"{name}_{k}" for k, name in enumerate(names)]


def _one_each(values: Iterable[Value] | None, paths: list[Path], key: str, default: list[Value]) -> list[Value]:
    chosen = default if values is None else list(values)
    if len(chosen) != len(paths):
        raise InputError(f"source.{key}: {len(chosen)} values for {len(paths)} files; give one each")
    return chosen


COUNT = re.compile(r"[ _.-]*(?:(?:run|rep|repeat|trial|take|try|no|nr)[ _.-]*)?\(?\d+\)?$", re.IGNORECASE)
DATE = re.compile(r"[ _.-]*\d{4}[-_.]?\d{2}[-_.]?\d{2}(?:[ T_.-]*\d{2}[-_.:h]?\d{2}(?:[-_.:m]?\d{2})?)?[ _.-]*")
NO_NAME = "motion"
COARSE = 0.005  # [s] between samples is enough to tell two commands apart


def kinds_of(names: Sequence[str], commands: Sequence[Array], step: float) -> list[str]:
    """The kind of each log: logs of one name but for a number or a date, if their commands (n, joints) agree."""
    words = [COUNT.sub("", DATE.sub("_", name)).strip("_ .-") or NO_NAME for name in names]
    stride = max(1, round(COARSE / step))
    coarse = [command[::stride] for command in commands]
    kinds = [""] * len(names)
    for word in dict.fromkeys(words):
        groups: list[list[int]] = []  # of one command each
        for k in (k for k, other in enumerate(words) if other == word):
            alike = (g for g in groups if lag_between(coarse[g[0]], coarse[k], stride * step) is not None)
            if (same := next(alike, None)) is not None:
                same.append(k)
            else:
                groups.append([k])
        for group in groups:
            for k in group:
                kinds[k] = word if len(groups) == 1 else names[group[0]]
    return kinds
