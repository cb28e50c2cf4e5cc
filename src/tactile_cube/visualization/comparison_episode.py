"""A comparison as a Rerun recording: the robot in motion, measured and simulated signals, failing intervals marked."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from tactile_cube.errors import InputError
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.units import SMALL, milli, shown
from tactile_cube.visualization.charts import Array, marked
from tactile_cube.visualization.comparison_report import outcome
from tactile_cube.visualization.rerun_recording import Branch, log_robot, recording_file, whole

POSE_RATE = 50.0  # [Hz] of the robot's poses
SIGNAL_RATE = 250.0  # [Hz] of the signals at most
PAUSE = 1.0  # [s] between two trials on the time line
COMMAND, MEASURED, SIMULATED, FAILING = (140, 140, 140), (230, 130, 20), (80, 150, 255), (230, 60, 60)


def write_comparison(comparison: Comparison, path: Path) -> None:
    """Write the recording with its blueprint; open it with `rerun FILE.rrd`.

    The trials follow one another on the time line. The robot moves as measured; a joint that fails is plotted in red.

    Args:
        comparison: what was compared.
        path: file to write, `.rrd`.
    """
    starts = trial_starts(comparison)
    with recording_file(path, _blueprint(comparison), "tactile_cube_compare") as stream:
        branch = Branch(stream)
        _log_robot(branch, comparison, starts)
        for index, joint in enumerate(comparison.recording.joints):
            _log_joint(branch, comparison, index, joint, starts)
        _log_events(branch, comparison, starts)
        branch.always("summary", rr.TextDocument(_in_words(comparison), media_type="text/markdown"))


def trial_starts(comparison: Comparison) -> list[float]:
    """Return when each trial begins on the common time line [s]."""
    lengths = [trial.duration + PAUSE for trial in comparison.recording.trials]
    return [float(start) for start in np.concatenate([[0.0], np.cumsum(lengths)[:-1]])]


def _blueprint(comparison: Comparison) -> rrb.Blueprint:
    """Lay out the robot and a summary on the left, one tab per joint on the right."""
    tabs = [
        rrb.Vertical(
            rrb.TimeSeriesView(name=f"{joint}: command, measured, simulated [{unit}]", origin=f"/joints/{joint}/angle"),
            rrb.TimeSeriesView(
                name=f"{joint}: measured - simulated [{SMALL[unit][0]}]", origin=f"/joints/{joint}/error"
            ),
            name=joint,
        )
        for joint, unit in comparison.recording.shown.items()
    ]
    worst = max(comparison.errors.joints, key=lambda j: comparison.errors.joints[j] / comparison.floor.joints[j])
    left = rrb.Vertical(
        rrb.Spatial3DView(name="The rig, as measured", origin="/", contents=["/robot/**"], line_grid=False),
        rrb.Tabs(
            rrb.TextDocumentView(name="Where it fails", origin="/summary"),
            rrb.TextLogView(name="Failing intervals", origin="/failing"),
        ),
        row_shares=[3, 2],
    )
    active = list(comparison.recording.joints).index(worst)
    return whole(rrb.Horizontal(left, rrb.Tabs(*tabs, active_tab=active), column_shares=[2, 3]))


def _in_words(comparison: Comparison) -> str:
    units, floors = comparison.recording.shown, comparison.floor.joints
    rows = [
        f"| {joint} | {milli(error, units[joint])} | {milli(floors[joint], units[joint])} |"
        for joint, error in comparison.errors.joints.items()
    ]
    table = ["| joint | error | noise floor |", "|---|---|---|", *rows]
    where = [f"- {sentence}" for sentence in comparison.sentences]
    return "\n".join([f"# {comparison.recording.name}", "", outcome(comparison), "", *table, "", *where])


def _log_robot(branch: Branch, comparison: Comparison, starts: list[float]) -> None:
    recording = comparison.recording
    try:
        tree = log_robot(branch.stream, recording.rig.text, "robot")
    except Exception as error:  # of a shape that Rerun does not know
        reason = str(error).strip().partition("\n")[0]
        raise InputError(f"{recording.rig.path}: cannot be drawn ({reason}); mend it, or say rerun=false") from None
    stride = max(1, round(recording.rate / POSE_RATE))
    time = np.concatenate([start + t.time[::stride] for start, t in zip(starts, recording.trials, strict=True)])
    angles = np.concatenate([trial.position[::stride] for trial in recording.trials])
    moving = {name: angles[:, index] for index, name in enumerate(recording.joints)}
    for name, coupling in recording.description.coupled.items():
        moving.setdefault(name, coupling.ratio * moving[coupling.joint] + coupling.offset)
    for joint in tree.joints():
        if joint.name in moving:
            transform = joint.compute_transform_columns(moving[joint.name].tolist(), clamp=False)
            branch.columns(f"robot/joint_transforms/{joint.name}", time, transform)


def _log_joint(branch: Branch, comparison: Comparison, index: int, joint: str, starts: list[float]) -> None:
    recording, trials = comparison.recording, comparison.recording.trials
    stride, unit = max(1, round(recording.rate / SIGNAL_RATE)), recording.shown[joint]
    times = shown("[rad]", unit)[1]

    def joined(parts: Sequence[Array]) -> Array:
        """Join all trials on one time line; a missing sample after each interrupts the curve."""
        return np.concatenate([np.append(part[::stride], np.nan) for part in parts])

    time = joined([start + trial.time for start, trial in zip(starts, trials, strict=True)])
    time = np.where(np.isnan(time), np.roll(time, 1) + 1e-3, time)
    failing = np.zeros(len(time), dtype=bool)
    for number, start in enumerate(starts):
        for begin, end in marked(comparison, number, index):
            failing |= (time >= start + begin) & (time <= start + end)

    def send(entity: str, name: str, colour: tuple[int, int, int], values: Array, width: float = 1.2) -> None:
        branch.always(entity, rr.SeriesLines(names=[name], colors=[colour], widths=[width]))
        branch.columns(entity, time, rr.Scalars.columns(scalars=values))

    measured = times * joined([trial.position[:, index] for trial in trials])
    residual = SMALL[unit][1] * joined([error[:, index] for error in comparison.residuals])
    angle, error = f"joints/{joint}/angle", f"joints/{joint}/error"
    if not recording.torque_controlled:
        send(f"{angle}/command", "command", COMMAND, times * joined([trial.command[:, index] for trial in trials]))
    simulated = times * joined([one.position[:, index] for one in comparison.simulated])
    send(f"{angle}/simulated", "simulated", SIMULATED, simulated)
    for entity, name, colour, values in (
        (angle, "measured", MEASURED, measured),
        (error, "measured - simulated", SIMULATED, residual),
    ):
        send(f"{entity}/good", name, colour, np.where(failing, np.nan, values))
        send(f"{entity}/failing", f"{name}, failing", FAILING, np.where(failing, values, np.nan), 2.0)


def _log_events(branch: Branch, comparison: Comparison, starts: list[float]) -> None:
    begin = dict(zip((trial.name for trial in comparison.recording.trials), starts, strict=True))
    for trial, start in begin.items():
        branch.log("failing", rr.TextLog(f"trial {trial}", level=rr.TextLogLevel.INFO), start)
    units = comparison.recording.shown
    for one in comparison.failing_intervals:
        line = f"{one.joint} in {one.trial}: {one.start:.2f} .. {one.end:.2f} s, {milli(one.error, units[one.joint])}"
        branch.log("failing", rr.TextLog(line, level=rr.TextLogLevel.WARN), begin[one.trial] + one.start)
