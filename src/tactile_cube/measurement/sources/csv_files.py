"""Logs of another program as a recording; what is not said of them is guessed, and told, and doubted."""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from glob import glob
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.comparing.noise_floor import lag_between
from tactile_cube.measurement.recordings.columns import SIGNALS, TrialColumns
from tactile_cube.measurement.recordings.consistency import gains_of
from tactile_cube.measurement.recordings.description import Description, PerJoint, TrialEntry
from tactile_cube.measurement.recordings.plausibility import torque_over_law
from tactile_cube.measurement.recordings.rig import Rig, RigJoint
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, cut_trial
from tactile_cube.measurement.sources.column_map import NEEDED, ColumnMap, map_columns
from tactile_cube.measurement.sources.gains import estimated_gains, gain_doubts
from tactile_cube.measurement.sources.log_file import Log, read_logs
from tactile_cube.measurement.sources.mechanism import Mechanism
from tactile_cube.measurement.sources.source import described, rate_of, with_stated
from tactile_cube.measurement.sources.tidy import apart, joined, trials_of, without_equal_rows
from tactile_cube.measurement.sources.units import (
    RANGE,
    Unit,
    calibrated_spans,
    geared,
    is_flag,
    position_unit,
    same_unit,
    time_unit,
    torque_unit,
    voltage_unit,
)

Array = NDArray[np.float64]
Value = TypeVar("Value")
Units = dict[str, dict[str, Unit]]
"""Joint -> signal -> unit."""
OF_SOME = {"link_position": np.nan, "feedforward": 0.0}
"""Signals that some joints may have, and what stands for those of the others."""
SHOWN = 3  # steps of one kind
ASIDE = ("words", "left out", "array", "list column")


@dataclass(frozen=True)
class CsvFiles:
    """Imports logs; conf/source/csv.yaml says what each setting means, and its units."""

    files: Iterable[str]
    urdf: str | None
    robot: str | None
    mass: float | None
    lever: float | None
    servo: str | None
    gain: float | None
    controller: Mapping[str, Any]
    columns: Mapping[str, str | Mapping[str, str]] | None
    nominal: Mapping[str, PerJoint | None]
    gravity: Iterable[float]
    rate: float | None
    angle_unit: str | int | None
    length_unit: str | None
    time_unit: str | None
    torque_unit: str | None
    calibration: str | None
    gear: float | None
    read: str
    resolution: float
    length: float | None
    initialisation: Iterable[int] | None
    kind: Iterable[str] | None

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """One recording of all files."""
        mode, rig = str(self.controller.get("mode") or "position"), self._mechanism.rig()
        if mode not in NEEDED:
            raise InputError(f"source.controller.mode={mode}: unknown; choose one of {', '.join(NEEDED)}")
        left: list[str] = []
        logs = self._logs([name for name, joint in rig.joints.items() if joint.mimics is None], mode)
        columns = self._columns(logs[0], rig, mode)
        whole = _each(lambda log: [_checked(log, columns)], logs, left)
        stamps = None
        if columns.time is not None:
            stamps = time_unit(self.time_unit, _label(whole[0], columns.time), whole[0].table[columns.time])
        second = stamps.size if stamps is not None else 1.0
        pieces = _each(lambda log: trials_of(log, columns, second, mode == "free"), whole, left)
        units = self._units(pieces, columns, rig.joints, mode)
        trials = [_trial(piece, columns, units, second, self.rate) for piece in pieces]
        rate = self.rate if self.rate is not None else rate_of(trials[0].time, 3, str(pieces[0].path))
        trials = self._named(trials, pieces, logs, 1 / rate)
        pull = float(np.linalg.norm(list(self.gravity)))
        rig = self._mechanism.sized(rig, trials, mode, self.controller.get("kp"), pull)
        description = self._description(trials, list(columns.joints), rig, rate, mode)
        doubts = [*columns.doubts, *rig.doubts, *_doubts(units, columns, trials, description, rig)]
        doubts += [f"left out: {reason}" for reason in left]
        by = "source.kind" if self.kind is not None else "file names and commands"
        count = Counter(trial.entry.kind for trial in trials)
        repeats = ", ".join(f"{kind} x {n}" if n > 1 else kind for kind, n in count.items())
        understood = [*_steps(pieces), *_rows(columns, units, stamps, rate), ("kinds", repeats, by)]
        understood += rig.understood(list(columns.joints))
        tables = [piece for trial in trials for piece in cut_trial(trial, self.length)]
        degrees = {joint: "deg" for joint, one in units.items() if one["position"].name.split()[0] == "deg"}
        description = description.model_copy(update={"doubts": list(dict.fromkeys(doubts)), "shown_in": degrees})
        return {"": RecordingTables(description, rig.text, tables, [row for row in understood if row[1]])}

    @property
    def _mechanism(self) -> Mechanism:
        return Mechanism(self.urdf, self.robot, self.mass, self.lever, self.servo, self.gain)

    def _logs(self, joints: Sequence[str], mode: str) -> list[Log]:
        """All logs, each under a name of its own."""

        def whole(names: Sequence[str]) -> bool:
            try:
                return set(map_columns(names, joints, self.columns or {}, mode).names) <= set(names)
            except InputError:
                return False

        logs = joined([apart(log) for path in self._paths() for log in read_logs(path)], whole)
        names = _distinct([log.path for log in logs])
        return [replace(log, name=name, whole=name) for log, name in zip(logs, names, strict=True)]

    def _columns(self, log: Log, rig: Rig, mode: str) -> ColumnMap:
        joints = [name for name, joint in rig.joints.items() if joint.mimics is None]
        flags = [name for name, values in log.table.items() if is_flag(values)]
        try:
            columns = map_columns(list(log.table), joints, self.columns or {}, mode, flags)
        except InputError as error:
            aside = "; ".join(how for what, how in log.steps if what in ASIDE)
            raise InputError(f"{log.path}: {error}{f' ({aside})' if aside else ''}") from None
        if columns.time is None and self.rate is None:
            raise InputError(
                f"{log.path}: no column of time among {list(log.table)}; say 'source.columns={{time: COLUMN, ...}}', "
                "or source.rate=HZ where rows follow one another at a fixed rate"
            )
        if self.gear is not None and not (self.gear and any("link_position" in one for one in columns.joints.values())):
            raise InputError(
                f"source.gear={self.gear:g}: give turns, not 0, and log both the motor's and the link's angle"
            )
        return columns

    def _units(self, logs: Sequence[Log], columns: ColumnMap, joints: Mapping[str, RigJoint], mode: str) -> Units:
        """The units of the signals, told by the values of all logs together."""
        units: Units = {}
        spans = {} if self.calibration is None else calibrated_spans(Path(self.calibration))
        if spans and self.angle_unit not in (RANGE, "deg"):
            raise InputError(f"source.calibration={self.calibration}: say source.angle_unit=range (or deg) beside it")
        for name, entry in columns.joints.items():
            if name not in joints:
                raise InputError(f"source.columns.{name}: no such joint in the URDF; it has {', '.join(joints)}")
            joint, found = joints[name], units.setdefault(name, {})
            said = self.length_unit if joint.prismatic else self.angle_unit
            values = {signal: np.concatenate([log.table[column] for log in logs]) for signal, column in entry.items()}
            for signal, column in entry.items():
                label = _label(logs[0], column)
                if signal == "command" and mode == "voltage":
                    found[signal] = voltage_unit(label, self._motor()[0])
                elif signal in ("torque", "feedforward") or (mode == "torque" and signal == "command"):
                    found[signal] = torque_unit(self.torque_unit, label, joint.prismatic, values[signal])
                else:
                    found[signal] = position_unit(said, label, values[signal], joint, spans)
            spread = float(np.ptp(values["command"])) if mode == "position" else 0.0
            if spread > 0:
                ratio = float(np.ptp(values["position"])) / spread
                found["command"], found["position"] = same_unit(found["command"], found["position"], ratio)
            if "link_position" in entry:
                found |= geared(found, values, entry, self.gear)
        return units

    def _motor(self) -> tuple[float, float]:
        """Torque of a volt at standstill, kt / R, and damping by the back-EMF, kt^2 / R."""
        kt, resistance = (self.controller.get(key) for key in ("kt", "R"))
        if not all(isinstance(one, int | float) and 0 < one < np.inf for one in (kt, resistance)):
            raise InputError(
                f"source.controller.kt={kt}, R={resistance}: mode=voltage needs kt [N m/A] and R [ohm] of the motor, "
                "as seen at the joint: torque = kt / R (u - kt dq)"
            )
        return float(kt) / float(resistance), float(kt) ** 2 / float(resistance)  # type: ignore[arg-type]

    def _named(
        self, trials: Sequence[TrialTable], pieces: Sequence[Log], logs: Sequence[Log], step: float
    ) -> list[TrialTable]:
        """The trials with their kinds and initialisations."""
        names = [log.name for log in logs]
        whose = [names.index(piece.whole) for piece in pieces]
        starts = _one_each(self.initialisation, names, "initialisation", [0] * len(names))
        stems = [piece.path.stem + piece.name.removeprefix(piece.whole) for piece in pieces]
        guessed = kinds_of(stems, [trial.command for trial in trials], step)
        kinds = guessed if self.kind is None else [_one_each(self.kind, names, "kind", names)[k] for k in whose]
        entries = [
            trial.entry.model_copy(update={"initialisation": starts[k], "kind": kind})
            for trial, k, kind in zip(trials, whose, kinds, strict=True)
        ]
        return [replace(trial, entry=entry) for trial, entry in zip(trials, entries, strict=True)]

    def _description(
        self, trials: Sequence[TrialTable], joints: list[str], rig: Rig, rate: float, mode: str
    ) -> Description:
        """What recording.yaml is to say; gains that nobody states are unknown, and begin where the log has them."""
        said = with_stated({k: v for k, v in self.controller.items() if k not in ("kt", "R")}, rig.gains, joints)
        nominal = with_stated(self.nominal, rig.nominal, joints)
        stated = {key for key, value in [*self.controller.items(), *self.nominal.items()] if value is not None}
        unknown = [key for key in rig.unknown if key not in stated and (key != "kd" or mode == "position")]
        if mode == "position":
            lacking = [key for key in ("kp", "kd") if key not in said]
            lacking += [key for key in ("reflected_inertia",) if lacking and key not in nominal]
            unknown = list(dict.fromkeys([*unknown, *lacking]))
            found = estimated_gains(trials, joints, rig, tuple(self.gravity)) if lacking else {}
            for key in lacking:
                values = {joint: float(f"{found[key][k]:.4g}") for k, joint in enumerate(joints)}
                (nominal if key == "reflected_inertia" else said)[key] = values
        elif mode == "voltage":
            said["kd"] = self._motor()[1]
        else:
            said["mode"] = "torque"
        return described(
            gravity=list(self.gravity), rate_hz=rate, joints=joints, controller=said, nominal=nominal, unknown=unknown,
            sensors={"read": self.read, "position_resolution": self.resolution},
        )  # fmt: skip

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


def _each(make: Callable[[Log], list[Log]], logs: Sequence[Log], left: list[str]) -> list[Log]:
    """What is made of each log; those of which nothing can be made are left out, unless that is all of them."""
    made: list[Log] = []
    for log in logs:
        try:
            made += make(log)
        except InputError as error:
            left.append(str(error))
    if not made:
        raise InputError(left[0])
    return made


def _checked(log: Log, columns: ColumnMap) -> Log:
    """The log without equal rows.

    Raises:
        InputError: it lacks a column, or has words in one.
    """
    for name in columns.names:
        if name not in log.table:
            raise InputError(f"{log.path}: column '{name}' is missing; the columns of numbers are {list(log.table)}")
        if name in log.wrong:
            row, word = log.wrong[name]
            raise InputError(f"{log.path}: column '{name}', row {row}: expected a number, not '{word}'")
    return without_equal_rows(log, columns)


def _label(log: Log, column: str) -> str:
    """A column's name with the unit that stands below it."""
    return f"{column} [{log.units[column]}]" if column in log.units else column


def _trial(log: Log, columns: ColumnMap, units: Units, second: float, rate: float | None) -> TrialTable:
    values: dict[str, Array] = {}
    rows = len(next(iter(log.table.values())))
    for signal in SIGNALS:
        has = [signal in entry for entry in columns.joints.values()]
        if all(has) or (any(has) and signal in OF_SOME):
            lacking = np.full(rows, OF_SOME.get(signal, 0.0))
            one = [
                units[joint][signal].of(log.table[c[signal]]) if signal in c else lacking
                for joint, c in columns.joints.items()
            ]
            values[signal] = np.stack(one, axis=1)
    values.setdefault("command", np.zeros_like(values["position"]))
    if columns.time is not None:
        time = (log.table[columns.time] - log.table[columns.time][0]) * second
    else:
        time = np.arange(rows) / (rate or 1.0)
    entry = TrialEntry(file=f"trials/{log.name}.parquet", note=f"from {log.path.name}")
    return TrialTable(entry, time, origin=log.path, **values)


def _doubts(
    units: Units, columns: ColumnMap, trials: Sequence[TrialTable], description: Description, rig: Rig
) -> Iterator[str]:
    """What units and gains leave open; a torque that goes with the controller's law needs no other proof."""
    try:
        gains = gains_of(description, None, "controller")
    except ValueError:  # which is said when the recording is read
        return
    first = trials[0]
    signals = TrialColumns(first.time, first.command, first.position, first.torque)
    open_: dict[str, list[str]] = {}
    for index, (joint, entry) in enumerate(units.items()):
        for signal, unit in entry.items():
            proven = signal == "torque" and 0.2 < (torque_over_law(signals, index, gains) or 0.0) < 5.0
            if unit.doubt and not proven:
                open_.setdefault(unit.doubt, []).append(columns.joints[joint][signal])
    for doubt, names in open_.items():
        yield f"{', '.join(names)}: {doubt}"
    for key in [key for key in description.unknown if key not in rig.unknown]:
        begins = getattr(description.controller, key, description.nominal.get(key))
        yield f"{key} is not stated: unknown, to be identified from {begins}, a guess"
    if description.controller.mode == "position":
        found = estimated_gains(trials, description.joints, rig, description.gravity)
        yield from gain_doubts(gains.kp, found, "kp" in description.unknown)


def _steps(logs: Sequence[Log]) -> Iterator[tuple[str, str, str]]:
    """What was done to the logs, each step once."""
    steps = list(dict.fromkeys(step for log in logs for step in log.steps))
    for what in dict.fromkeys(what for what, _ in steps):
        hows = [how for one, how in steps if one == what]
        yield what, "; ".join(hows[:SHOWN]) + (f"; and {len(hows) - SHOWN} more" if len(hows) > SHOWN else ""), ""


def _rows(columns: ColumnMap, units: Units, stamps: Unit | None, rate: float) -> Iterator[tuple[str, str, str]]:
    """What was understood, for people: what, how, and what told it."""
    if stamps is not None:
        yield "time", f"{columns.time} [{stamps.name}], {rate:g} Hz", stamps.source
    for joint, entry in columns.joints.items():
        for signal, column in entry.items():
            yield f"{joint} {signal}", f"{column} [{units[joint][signal].name}]", units[joint][signal].source
    yield "not used", ", ".join(columns.unused), ""


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


def _one_each(values: Iterable[Value] | None, logs: Sequence[str], key: str, default: list[Value]) -> list[Value]:
    chosen = default if values is None else list(values)
    if len(chosen) != len(logs):
        raise InputError(f"source.{key}: {len(chosen)} values for {len(logs)} files; give one each")
    return chosen


COUNT = re.compile(r"[ _.-]*(?:(?:run|rep|repeat|episode|part|trial|take|try|no|nr)[ _.-]*)?\(?\d+\)?$", re.IGNORECASE)
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
