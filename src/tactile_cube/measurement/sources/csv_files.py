"""Tables of another program (CSV, Parquet or NPZ) as a recording, by a small map of columns."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from glob import glob
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.rig import read_rig
from tactile_cube.measurement.recordings.tables import Table, read_table
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.sources.source import described

Array = NDArray[np.float64]
Value = TypeVar("Value")
ANGLE_UNITS = {"rad": 1.0, "deg": np.pi / 180, "turn": 2 * np.pi}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
TORQUE_UNITS = {"Nm": 1.0, "mNm": 1e-3, "Ncm": 1e-2}


@dataclass(frozen=True)
class CsvFiles:
    """Imports tables.

    Attributes:
        files: paths or patterns; one trial each.
        urdf: path of the rig's URDF.
        columns: `time` -> its column, and joint -> {command, position, torque} -> column; torque may be left out.
        controller: kp, kd, torque_limit.
        nominal: stiffness, static_friction, reflected_inertia, as far as known.
        gravity: (3,) in the base frame [m/s^2].
        rate: samples per second; null: the median of the first file.
        angle_unit: rad, deg or turn.
        time_unit: s, ms, us or ns.
        torque_unit: Nm, mNm or Ncm.
        read: `after` or `before` the control period, see recording.yaml's sensors.
        resolution: of the position [rad].
        initialisation: of each file, by default 0 for all.
        kind: of each file, by default the file's name.
    """

    files: Iterable[str]
    urdf: str
    columns: Mapping[str, str | Mapping[str, str]]
    controller: Mapping[str, float]
    nominal: Mapping[str, float] = field(default_factory=dict)
    gravity: Iterable[float] = (0.0, 0.0, -9.81)
    rate: float | None = None
    angle_unit: str = "rad"
    time_unit: str = "s"
    torque_unit: str = "Nm"
    read: str = "after"
    resolution: float = 0.0
    initialisation: Iterable[int] | None = None
    kind: Iterable[str] | None = None

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """One recording of all files."""
        paths = self._paths()
        kinds = _one_each(self.kind, paths, "kind", [path.stem for path in paths])
        starts = _one_each(self.initialisation, paths, "initialisation", [0] * len(paths))
        rig = read_rig(Path(self.urdf))
        tables = []
        for path, kind, start in zip(paths, kinds, starts, strict=True):
            entry = TrialEntry(
                file=f"trials/{path.stem}.parquet", initialisation=start, kind=kind, note=f"from {path.name}"
            )
            tables.append(self._trial(read_table(path), path, entry))
        rate = self.rate if self.rate is not None else float(np.round(1 / np.median(np.diff(tables[0].time)), 3))
        description = described(
            gravity=list(self.gravity), rate_hz=rate, joints=list(self._joints()), controller=dict(self.controller),
            nominal=dict(self.nominal), sensors={"read": self.read, "position_resolution": self.resolution},
        )  # fmt: skip
        return {"": RecordingTables(description, rig.text, tables)}

    def _joints(self) -> dict[str, Mapping[str, str]]:
        joints = {name: entry for name, entry in self.columns.items() if isinstance(entry, Mapping)}
        if not joints or not isinstance(self.columns.get("time"), str):
            raise InputError(f"source.columns: expected time: COLUMN and JOINT: {{command: ..., position: ...}}, "
                             f"received {dict(self.columns)}")  # fmt: skip
        return joints

    def _paths(self) -> list[Path]:
        found = [Path(name) for pattern in self.files for name in sorted(glob(pattern)) or [pattern]]
        if not found:
            raise InputError("source.files: no file given")
        return found

    def _trial(self, table: Table, path: Path, entry: TrialEntry) -> TrialTable:
        angle, joints = _unit(self.angle_unit, ANGLE_UNITS, "angle_unit"), self._joints()
        time = _column(table, str(self.columns["time"]), path) * _unit(self.time_unit, TIME_UNITS, "time_unit")
        signals = {}
        for signal, unit in (
            ("command", angle),
            ("position", angle),
            ("torque", _unit(self.torque_unit, TORQUE_UNITS, "torque_unit")),
        ):
            names = [joint.get(signal) for joint in joints.values()]
            if signal == "torque" and None in names:
                continue
            signals[signal] = unit * np.stack([_column(table, str(name), path) for name in names], axis=1)
        return TrialTable(entry, time, signals["command"], signals["position"], signals.get("torque"))


def _column(table: Table, name: str, path: Path) -> Array:
    if name not in table:
        raise InputError(f"{path}: column '{name}' is missing (source.columns names it); the file has {list(table)}")
    return table[name]


def _unit(name: str, units: Mapping[str, float], key: str) -> float:
    if name not in units:
        raise InputError(f"source.{key}={name}: unknown; choose one of {', '.join(units)}")
    return units[name]


def _one_each(values: Iterable[Value] | None, paths: list[Path], key: str, default: list[Value]) -> list[Value]:
    chosen = default if values is None else list(values)
    if len(chosen) != len(paths):
        raise InputError(f"source.{key}: {len(chosen)} values for {len(paths)} files; give one each")
    return chosen
