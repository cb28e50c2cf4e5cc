"""Tables of another program (CSV, Parquet or NPZ) as a recording; what is not said of them is guessed, and told."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from glob import glob
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.comparing.noise_floor import lag_between
from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.rig import Rig, read_rig
from tactile_cube.measurement.recordings.tables import Table, read_table
from tactile_cube.measurement.recordings.writing import RecordingTables
from tactile_cube.measurement.sources.column_map import ColumnMap, map_columns
from tactile_cube.measurement.sources.foreign_log import SaidUnits, cut_trial, understand
from tactile_cube.measurement.sources.source import described, known, median_rate

Array = NDArray[np.float64]
Value = TypeVar("Value")


@dataclass(frozen=True)
class CsvFiles:
    """Imports tables.

    Attributes:
        files: paths or patterns; one trial each.
        urdf: path of the rig's URDF.
        columns: `time` -> its column, and joint -> {command, position, torque} -> column; by default by their names.
        controller: kp, kd, torque_limit, mode.
        nominal: stiffness, static_friction, reflected_inertia, as far as known.
        gravity: (3,) in the base frame [m/s^2].
        rate: samples per second; null: the median of the first file.
        angle_unit: rad, deg, turn or mrad; null: by the columns' names or the joints' limits.
        length_unit: m, mm or um, of sliding joints; null: likewise.
        time_unit: s, ms, us or ns; null: by the column's name or its steps.
        torque_unit: Nm, mNm or Ncm (N, mN or kN of sliding joints); null: by the columns' names.
        read: `after` or `before` the control period, see recording.yaml's sensors.
        resolution: of the position [rad].
        length: cut each file into trials of this length [s]; null: one trial a file.
        initialisation: of each file, by default 0 for all.
        kind: of each file; by default files are of one kind if their names differ in a number or date only and their
            commands agree.
    """

    files: Iterable[str]
    urdf: str
    controller: Mapping[str, float | str | None]
    columns: Mapping[str, str | Mapping[str, str]] | None = None
    nominal: Mapping[str, float | None] = field(default_factory=dict)
    gravity: Iterable[float] = (0.0, 0.0, -9.81)
    rate: float | None = None
    angle_unit: str | None = None
    length_unit: str | None = None
    time_unit: str | None = None
    torque_unit: str | None = None
    read: str = "after"
    resolution: float = 0.0
    length: float | None = None
    initialisation: Iterable[int] | None = None
    kind: Iterable[str] | None = None

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """One recording of all files."""
        controller = self._controller()
        torque_mode = controller.get("mode") == "torque"
        paths, rig = self._paths(), read_rig(Path(self.urdf))
        tables = {path: read_table(path, only_numbers=False) for path in paths}
        columns = self._columns(tables[paths[0]], paths[0], rig, torque_mode)
        said = SaidUnits(self.time_unit, self.angle_unit, self.length_unit, self.torque_unit)
        reading = understand(tables, columns, rig.joints, said, torque_mode)
        starts = _one_each(self.initialisation, paths, "initialisation", [0] * len(paths))
        entries = [
            TrialEntry(file=f"trials/{name}.parquet", initialisation=start, note=f"from {path.name}")
            for path, name, start in zip(paths, _distinct(paths), starts, strict=True)
        ]
        trials = [reading.trial(tables[p], p, entry, self.rate) for p, entry in zip(paths, entries, strict=True)]
        rate = self.rate if self.rate is not None else median_rate(trials[0].time, 3, str(paths[0]))
        guessed = kinds_of([path.stem for path in paths], [trial.command for trial in trials], 1 / rate)
        kinds = _one_each(self.kind, paths, "kind", guessed)
        named = [
            replace(trial, entry=trial.entry.model_copy(update={"kind": kind}))
            for trial, kind in zip(trials, kinds, strict=True)
        ]
        description = described(
            gravity=list(self.gravity), rate_hz=rate, joints=list(columns.joints), controller=controller,
            nominal=known(self.nominal), sensors={"read": self.read, "position_resolution": self.resolution},
        )  # fmt: skip
        pieces = [piece for trial in named for piece in cut_trial(trial, self.length)]
        by = "source.kind" if self.kind is not None else "file names and commands"
        understood = [*reading.rows(rate), ("kinds", _repeats(kinds), by)]
        return {"": RecordingTables(description, rig.text, pieces, [row for row in understood if row[1]])}

    def _controller(self) -> dict[str, float | str]:
        said: dict[str, float | str] = known(self.controller)
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


def _repeats(kinds: list[str]) -> str:
    count = Counter(kinds)
    return ", ".join(f"{kind} x {n}" if n > 1 else kind for kind, n in count.items())


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
    """The kind of each log: logs of one name but for a number or a date, if their commands (n, joints) agree.

    Args:
        names: of the files, without endings.
        commands: as logged.
        step: time between samples [s].
    """
    words = [COUNT.sub("", DATE.sub("_", name)).strip("_ .-") or NO_NAME for name in names]
    stride = max(1, round(COARSE / step))
    coarse = [command[::stride] for command in commands]
    kinds = [""] * len(names)
    for word in dict.fromkeys(words):
        members = [k for k, other in enumerate(words) if other == word]
        groups = _alike(members, coarse, stride * step)
        for group in groups:
            for k in group:
                kinds[k] = word if len(groups) == 1 else names[group[0]]
    return kinds


def _alike(members: Sequence[int], commands: Sequence[Array], step: float) -> list[list[int]]:
    groups: list[list[int]] = []
    for k in members:
        known = (group for group in groups if lag_between(commands[group[0]], commands[k], step) is not None)
        same = next(known, None)
        if same is None:
            groups.append([k])
        else:
            same.append(k)
    return groups
