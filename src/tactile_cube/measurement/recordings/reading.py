"""A recording on disk: recording.yaml, the rig's URDF and one table a trial, read and checked."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tactile_cube import limits
from tactile_cube.drivetrain.plain_yaml import read_schema
from tactile_cube.errors import InputError
from tactile_cube.hand.urdf_tree import with_own_files
from tactile_cube.measurement.recordings import consistency, plausibility
from tactile_cube.measurement.recordings.columns import (
    MINIMUM_SAMPLES,
    check_time,
    on_grid,
    pick_columns,
    rows_of,
    without_outliers,
)
from tactile_cube.measurement.recordings.consistency import check_nominal, gains_of
from tactile_cube.measurement.recordings.description import Description, TrialEntry, per_joint
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import Rig, parse_rig
from tactile_cube.measurement.recordings.tables import read_table
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.untrusted_file import below, read_text

DESCRIPTION = "recording.yaml"


def read_recording(folder: str | Path) -> Recording:
    """Read the recording in a folder, checked and on a uniform time grid.

    Raises:
        InputError: naming file, column, row and value of what cannot be used.
    """
    folder = Path(folder)
    if not os.path.lexists(folder / DESCRIPTION):
        if not folder.exists():
            raise InputError(f"recording={folder}: no such folder; a recording is a folder with {DESCRIPTION} in it")
        raise InputError(
            f"recording={folder}: {DESCRIPTION}: no such file; of a log, record makes a recording: source=csv "
            f"source.files={folder} source.urdf=FILE out=FOLDER"
        )
    file = below(folder, DESCRIPTION, f"recording={folder}")
    description = read_schema(file, Description)
    path = below(folder, description.rig, f"{file}: key 'rig'")
    rig = parse_rig(read_text(path, "; recording.yaml names it under 'rig'"), path)
    urdf, not_drawn = with_own_files(rig.text, rig.path, folder)
    rig = replace(rig, text=urdf)
    consistency.check_joints(description, rig, file)
    try:
        recording = _assemble(folder, description, rig)
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{file}: {error}") from None
    consistency.check_inertia(recording)
    warnings = [f"{rig.path}: {line}" for line in recording.rigid_body().corrected]
    warnings += [*recording.warnings, *consistency.swap_warning(recording)]
    if not_drawn:
        warnings.append(f"{rig.path}: {len(not_drawn)} shapes are not drawn, the first for this: {not_drawn[0]}")
    return replace(recording, warnings=tuple(warnings))


def _assemble(folder: Path, description: Description, rig: Rig) -> Recording:
    file, joints = folder / DESCRIPTION, tuple(description.joints)
    nominal = {key: per_joint(value, joints, f"nominal.{key}") for key, value in description.nominal.items()}
    check_nominal(nominal, joints)
    warnings = [f"{file}: {line}" for line in (*description.doubts, *consistency.check_coupling(description, rig))]
    trials, gains, left = [], gains_of(description, None, "controller"), limits.NUMBERS
    undamped = [joint for joint, kd in zip(joints, gains.kd, strict=True) if kd == 0]
    if description.controller.mode == "position" and undamped:
        warnings.append(f"{file}: key 'controller.kd': 0 for {', '.join(undamped)}: no damping")
    for index, entry in enumerate(description.trials):
        path = below(folder, entry.file, f"{file}: key 'trials.{index}.file'")
        trial = _trial(path, left, entry, description, rig, f"trials.{index}.controller")
        left -= trial.time.size + 3 * trial.position.size
        trial = trial.with_earlier_commands(description.sensors.commands_late)
        trials += without_excluded(trial, entry.exclude, f"{file}: key 'trials.{index}.exclude'")
        warnings += trial.warnings
    if not trials:
        raise InputError(f"{file}: key 'trials': 'exclude' leaves nothing of any trial")
    return Recording(folder, description, rig, gains, nominal, on_one_clock(trials), tuple(warnings))


def _trial(path: Path, most: int, entry: TrialEntry, description: Description, rig: Rig, key: str) -> Trial:
    joints, rate = tuple(description.joints), description.rate_hz
    gains = gains_of(description, entry, key)
    columns, warnings = pick_columns(read_table(path, most), joints, path)
    columns, time_warnings = check_time(columns, rate, path)
    ranges = [rig.joints[joint] for joint in joints]
    columns, wrapped = plausibility.without_wraps(columns, ranges, path)
    warnings += wrapped
    if description.controller.mode == "position":
        warnings += plausibility.check_units(columns, ranges, gains, path)
        warnings += plausibility.check_assignment(columns, ranges, path) if entry.object is None else []
        warnings += plausibility.check_roles(columns, joints, path)
    plausibility.check_links(columns, joints, path)
    columns, outlying, single = without_outliers(columns, joints, path)
    grid, valid = on_grid(columns, rate)
    stamps = (columns.time[outlying] - columns.time[0]) * rate
    beside = np.concatenate([np.floor(stamps), np.ceil(stamps)]).astype(np.int64)
    valid[np.minimum(beside, len(valid) - 1)] = False
    valid &= grid.time >= entry.unjudged
    return Trial(
        name=path.stem,
        **{key: getattr(entry, key) for key in ("file", "kind", "initialisation", "force", "clamped", "touch")},
        **vars(grid),
        valid=valid,
        gains=gains,
        warnings=tuple(warnings + time_warnings + single),
        load=entry.object.of(description.object) if description.object and entry.object else None,
        begun=float(columns.time[0]),
    )


def without_excluded(trial: Trial, intervals: Sequence[tuple[float, float]], key: str) -> list[Trial]:
    """Cut the intervals out of a trial; return the parts as trials that start at 0, without those that are too short.

    Raises:
        InputError: an interval that ends before it starts.
    """
    if not intervals:
        return [trial]
    kept = np.ones(len(trial.time), dtype=bool)
    for start, end in intervals:
        if end <= start:
            raise InputError(f"{key}: received [{start:g}, {end:g}]; expected start < end [s]")
        kept &= (trial.time < start) | (trial.time >= end)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], kept, [False]]).astype(int)))
    pieces = [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= MINIMUM_SAMPLES]
    parts = [rows_of(trial, rows) for rows in pieces]
    return [
        replace(part, name=f"{trial.name}_{k}", time=part.time - part.time[0], begun=part.begun + part.time[0])
        for k, part in enumerate(parts)
    ]


def on_one_clock(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Return the trials, each `begun` so long after the first one of its initialisation.

    Where stamps overlap, as those of logs that all count from 0 do, they are no clock: each trial begins at 0.
    """
    first = dict[int, float]()
    last = dict[int, float]()
    for trial in sorted(trials, key=lambda one: one.begun):
        key = trial.initialisation
        overlaps = key in last and trial.begun < last[key] - 0.5 * trial.step
        first[key] = np.nan if overlaps else first.get(key, trial.begun)
        last[key] = trial.begun + trial.duration
    return tuple(replace(one, begun=float(np.nan_to_num(one.begun - first[one.initialisation]))) for one in trials)
