"""Import logs of another program; what is not stated is guessed, printed and checked."""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from glob import glob
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np

from tactile_cube.drivetrain.model_file import Strict
from tactile_cube.errors import InputError
from tactile_cube.measurement.comparing.noise_floor import lag_between
from tactile_cube.measurement.recordings.columns import OF_SOME, SIGNALS, Array, TrialColumns
from tactile_cube.measurement.recordings.consistency import gains_of
from tactile_cube.measurement.recordings.description import (
    Description,
    NotNegative,
    PerJoint,
    Positive,
    Rate,
    TrialEntry,
)
from tactile_cube.measurement.recordings.plausibility import torque_over_law
from tactile_cube.measurement.recordings.rig import Rig, RigJoint
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, cut_trial
from tactile_cube.measurement.sources import units as si
from tactile_cube.measurement.sources.column_map import ColumnMap, map_columns
from tactile_cube.measurement.sources.gains import estimated_gains, gain_doubts
from tactile_cube.measurement.sources.log_file import Log, read_logs
from tactile_cube.measurement.sources.mechanism import Mechanism
from tactile_cube.measurement.sources.source import described, listed, rate_of, with_stated
from tactile_cube.measurement.sources.tidy import apart, joined, trials_of, without_equal_rows

Value = TypeVar("Value")
Units = dict[str, dict[str, si.Unit]]
"""Joint -> signal -> unit."""
SHOWN = 3  # steps of one kind
REMEMBERED = 0.4  # [s] by which a drive has forgotten earlier commands, but for a rate limit
MOVING, LOOK = 0.2, 0.03  # of a trial's usual speed, and [s] that it is read from
ASIDE = ("words", "left out", "array", "list column")


class LoggedController(Strict):
    """Stated constants of the controller that made the logs."""

    kp: PerJoint | None = None
    kd: PerJoint | None = None
    torque_limit: PerJoint | None = None
    rate_hz: Rate | None = None
    mode: Literal["position", "torque", "voltage", "free"] = "position"
    kt: Positive | None = None
    R: Positive | None = None

    @property
    def motor(self) -> tuple[float, float]:
        """Torque of a volt at standstill, kt / R, and damping by the back-EMF, kt^2 / R.

        Raises:
            InputError: one of them is not stated.
        """
        if self.kt is None or self.R is None:
            raise InputError(
                f"source.controller.kt={self.kt}, R={self.R}: mode=voltage needs kt [N m/A] and R [ohm] of the motor, "
                "as seen at the joint: torque = kt / R (u - kt dq)"
            )
        return self.kt / self.R, self.kt**2 / self.R


@dataclass(frozen=True)
class CsvFiles(Mechanism):
    """Imports logs; conf/source/csv.yaml says what each setting means, and its units."""

    files: str | Sequence[str]
    controller: LoggedController
    columns: Mapping[str, str | Mapping[str, str]] | None
    nominal: Mapping[str, PerJoint | None]
    gravity: tuple[float, float, float]
    rate: Rate | None
    angle_unit: str | int | None
    length_unit: str | None
    time_unit: str | None
    torque_unit: str | None
    calibration: str | None
    gear: float | None
    read: Literal["before", "after"]
    resolution: NotNegative
    length: Positive | None
    initialisation: Sequence[int] | None
    kind: Sequence[str] | None

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Build one recording of all files."""
        mode, rig = self.controller.mode, self.rig()
        if mode != "voltage" and (self.controller.kt or self.controller.R):
            raise InputError(f"source.controller.mode={mode}: kt and R are of mode=voltage; say that or leave them out")
        left: list[str] = []
        logs = self._logs([name for name, joint in rig.joints.items() if joint.mimics is None])
        columns = self._columns(logs[0], rig)
        whole = _each(lambda log: [_checked(log, columns)], logs, left)
        stamps = None
        if columns.time is not None:
            stamps = si.time_unit(self.time_unit, _label(whole[0], columns.time), whole[0].table[columns.time])
        second = stamps.size if stamps is not None else 1.0
        pieces = _each(lambda log: trials_of(log, columns, second, mode == "free"), whole, left)
        units = self._units(pieces, columns, rig.joints)
        trials = [_trial(piece, columns, units, second, self.rate) for piece in pieces]
        rate = self.rate if self.rate is not None else rate_of(trials[0].time, 3, str(pieces[0].path))
        trials = self._named(trials, pieces, logs, 1 / rate)
        rig = self.sized(rig, trials, mode, self.controller.kp, float(np.linalg.norm(self.gravity)))
        description = self._description(trials, list(columns.joints), rig, rate)
        doubts = [*columns.doubts, *rig.doubts, *_doubts(units, columns, trials, description, rig)]
        doubts += [f"left out: {reason}" for reason in left]
        count = Counter(trial.entry.kind for trial in trials)
        repeats = ", ".join(f"{kind} x {n}" if n > 1 else kind for kind, n in count.items())
        by = "source.kind" if self.kind is not None else "file names and commands"
        understood = [*_steps(pieces), *_rows(columns, units, stamps, rate), ("kinds", repeats, by)]
        tables = [piece for trial in trials for piece in cut_trial(trial, self.length)]
        if moving := [k for k, table in enumerate(tables) if mode == "position" and _begins_in_motion(table)]:
            late = f"{len(moving)} of {len(tables)} trials; their first {REMEMBERED:g} s count in no error"
            understood.append(("begin in motion", late, "commands before are unknown"))
        for k in moving:
            entry = tables[k].entry.model_copy(update={"unjudged": REMEMBERED})
            tables[k] = replace(tables[k], entry=entry)
        understood += rig.understood(list(columns.joints))
        degrees = {joint: "deg" for joint, one in units.items() if one["position"].name.split()[0] == "deg"}
        description = description.model_copy(update={"doubts": list(dict.fromkeys(doubts)), "shown_in": degrees})
        return {"": RecordingTables(description, rig.text, tables, [row for row in understood if row[1]])}

    def _logs(self, joints: Sequence[str]) -> list[Log]:
        def whole(names: Sequence[str]) -> bool:
            try:
                return set(map_columns(names, joints, self.columns or {}, self.controller.mode).names) <= set(names)
            except InputError:
                return False

        paths: list[Path] = []
        for pattern in listed(self.files):
            matches = [Path(name) for name in sorted(glob(pattern, recursive=True))]
            if not matches:
                raise InputError(f"source.files: {pattern} matches no file{_beside(Path(pattern))}")
            paths += matches
        if not paths:
            raise InputError("source.files: no file given")
        logs = joined([apart(log) for path in dict.fromkeys(paths) for log in read_logs(path)], whole)
        # files of one name in several folders have the folder's before theirs
        count = Counter(log.path.stem for log in logs)
        names = [
            log.path.stem if count[log.path.stem] == 1 else f"{log.path.parent.name}_{log.path.stem}" for log in logs
        ]
        names = [name if names.count(name) == 1 else f"{name}_{k}" for k, name in enumerate(names)]
        return [replace(log, name=name, whole=name) for log, name in zip(logs, names, strict=True)]

    def _columns(self, log: Log, rig: Rig) -> ColumnMap:
        joints = [name for name, joint in rig.joints.items() if joint.mimics is None]
        flags = [name for name, values in log.table.items() if si.is_flag(values)]
        try:
            columns = map_columns(list(log.table), joints, self.columns or {}, self.controller.mode, flags)
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

    def _units(self, logs: Sequence[Log], columns: ColumnMap, joints: Mapping[str, RigJoint]) -> Units:
        units: Units = {}
        mode = self.controller.mode
        spans = {} if self.calibration is None else si.calibrated_spans(Path(self.calibration))
        if spans and self.angle_unit not in (si.RANGE, "deg"):
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
                    found[signal] = si.voltage_unit(label, self.controller.motor[0])
                elif signal in ("torque", "feedforward") or (mode == "torque" and signal == "command"):
                    found[signal] = si.torque_unit(self.torque_unit, label, joint.prismatic, values[signal])
                else:
                    found[signal] = si.position_unit(said, label, values[signal], joint, spans)
            spread = float(np.ptp(values["command"])) if mode == "position" else 0.0
            if spread > 0:
                ratio = float(np.ptp(values["position"])) / spread
                found["command"], found["position"] = si.same_unit(found["command"], found["position"], ratio)
            if "link_position" in entry:
                found |= si.geared(found, values, entry, self.gear)
        return units

    def _named(
        self, trials: Sequence[TrialTable], pieces: Sequence[Log], logs: Sequence[Log], step: float
    ) -> list[TrialTable]:
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

    def _description(self, trials: Sequence[TrialTable], joints: list[str], rig: Rig, rate: float) -> Description:
        """Build the content of recording.yaml; gains not stated are unknown and start from estimates of the log."""
        mode, stated = self.controller.mode, self.controller.model_dump(exclude={"kt", "R"}, exclude_none=True)
        said = with_stated({**stated, "mode": "torque" if mode == "free" else mode}, rig.gains, joints)
        nominal = with_stated(self.nominal, rig.nominal, joints)
        known = {*stated, *(key for key, value in self.nominal.items() if value is not None)}
        unknown = [key for key in rig.unknown if key not in known and (key not in ("kp", "kd") or mode == "position")]
        if mode == "position":
            lacking = [key for key in ("kp", "kd") if key not in said]
            lacking += [key for key in ("reflected_inertia",) if lacking and key not in nominal]
            unknown = list(dict.fromkeys([*unknown, *lacking]))
            found = estimated_gains(trials, joints, rig, self.gravity) if lacking else {}
            for key in lacking:
                values = {joint: float(f"{found[key][k]:.4g}") for k, joint in enumerate(joints)}
                (nominal if key == "reflected_inertia" else said)[key] = values
        elif mode == "voltage":
            said["kd"] = self.controller.motor[1]
        return described(
            gravity=list(self.gravity), rate_hz=rate, joints=joints, controller=said, nominal=nominal, unknown=unknown,
            sensors={"read": self.read, "position_resolution": self.resolution},
        )  # fmt: skip


def _each(make: Callable[[Log], list[Log]], logs: Sequence[Log], left: list[str]) -> list[Log]:
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
    for name in columns.names:
        if name not in log.table:
            raise InputError(f"{log.path}: column '{name}' is missing; the columns of numbers are {list(log.table)}")
        if name in log.wrong:
            row, word = log.wrong[name]
            raise InputError(f"{log.path}: column '{name}', row {row}: expected a number, not '{word}'")
        if np.isnan(log.table[name]).all():
            raise InputError(f"{log.path}: column '{name}' has no number in any row; name another in source.columns")
    return without_equal_rows(log, columns)


def _label(log: Log, column: str) -> str:
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


def _begins_in_motion(trial: TrialTable) -> bool:
    rows = max(1, int(np.searchsorted(trial.time, trial.time[0] + LOOK)))
    way = np.abs(trial.position[rows:] - trial.position[:-rows])
    long = trial.time[-1] - trial.time[0] > 4.0 * REMEMBERED
    return bool(long and (way[0] > MOVING * np.sqrt(np.mean(way**2, axis=0))).any())


def _doubts(
    units: Units, columns: ColumnMap, trials: Sequence[TrialTable], description: Description, rig: Rig
) -> Iterator[str]:
    """Yield doubts about units and gains; a torque that agrees with the controller's law needs no other proof."""
    try:
        gains = gains_of(description, None, "controller")
    except ValueError:  # reported when the recording is read
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
    if guesses := [key for key in description.unknown if key not in rig.unknown]:
        begins = [getattr(description.controller, key, description.nominal.get(key)) for key in guesses]
        said = "; ".join(f"{key} from {value}" for key, value in zip(guesses, begins, strict=True))
        yield f"not stated, so unknown and to be identified, beginning with guesses: {said}"
    if description.controller.mode == "position":
        found = estimated_gains(trials, description.joints, rig, description.gravity)
        yield from gain_doubts(gains.kp, found, "kp" in description.unknown)


def _steps(logs: Sequence[Log]) -> Iterator[tuple[str, str, str]]:
    steps = list(dict.fromkeys(step for log in logs for step in log.steps))
    for what in dict.fromkeys(what for what, _ in steps):
        hows = [how for one, how in steps if one == what]
        yield what, "; ".join(hows[:SHOWN]) + (f"; and {len(hows) - SHOWN} more" if len(hows) > SHOWN else ""), ""


def _rows(columns: ColumnMap, units: Units, stamps: si.Unit | None, rate: float) -> Iterator[tuple[str, str, str]]:
    if stamps is not None:
        yield "time", f"{columns.time} [{stamps.name}], {rate:g} Hz", stamps.source
    for joint, entry in columns.joints.items():
        for signal, column in entry.items():
            yield f"{joint} {signal}", f"{column} [{units[joint][signal].name}]", units[joint][signal].source
    yield "not used", ", ".join(columns.unused), ""


def _beside(pattern: Path) -> str:
    folder = pattern.parent
    if not folder.is_dir():
        return f"; there is no folder {folder}" if "*" not in str(folder) else ""
    names = sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))
    return f"; {folder} has {', '.join(names[:8]) or 'nothing'}{', ...' if len(names) > 8 else ''}"


def _one_each(values: Sequence[Value] | None, logs: Sequence[str], key: str, default: list[Value]) -> list[Value]:
    chosen = default if values is None else list(values)
    if len(chosen) != len(logs):
        raise InputError(f"source.{key}: {len(chosen)} values for {len(logs)} files; give one each")
    return chosen


COUNT = re.compile(r"[ _.-]*(?:(?:run|rep|repeat|episode|part|trial|take|try|no|nr)[ _.-]*)?\(?\d+\)?$", re.IGNORECASE)
DATE = re.compile(r"[ _.-]*\d{4}[-_.]?\d{2}[-_.]?\d{2}(?:[ T_.-]*\d{2}[-_.:h]?\d{2}(?:[-_.:m]?\d{2})?)?[ _.-]*")
NO_NAME = "motion"
COARSE = 0.005  # [s] between samples is enough to tell two commands apart


def kinds_of(names: Sequence[str], commands: Sequence[Array], step: float) -> list[str]:
    """Return each log's kind: logs of one name except a number or date are one kind if commands (n, joints) agree."""
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
