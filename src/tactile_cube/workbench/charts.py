"""The pictures of a workbench, drawn by Bokeh in the colours of the reports."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from bokeh.events import Tap
from bokeh.models import BoxAnnotation, ColumnDataSource, Range1d, Span
from bokeh.plotting import figure
from numpy.typing import NDArray

from tactile_cube.identification.next_experiment import Experiment
from tactile_cube.identification.search.residual_shape import Missing, shapes
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.comparing.error import residuals
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.units import THOUSANDTHS, of_joint
from tactile_cube.visualization.charts import BEFORE, ERROR, FAILING, FLOOR, GRID, MEASURED, PALETTE, SIMULATED
from tactile_cube.workbench.text import label, plain

Array = NDArray[np.float64]
TOOLS = "xpan,xwheel_zoom,box_zoom,reset,save"
POINTS, DRAWN = 3000, 20_000  # samples of the missing torque, and of a trial, that are drawn at most
CONTEXT = 0.5  # [s] shown on either side of a failing interval


def _figure(height: int, x: str, y: str, tools: str = TOOLS, **more: object) -> figure:
    made = figure(height=height, sizing_mode="stretch_width", tools=tools, **more)
    label(made.xaxis[0], x)
    label(made.yaxis[0], y)
    made.toolbar.logo = None
    made.grid.grid_line_color = GRID
    made.outline_line_color = None
    made.min_border_left = 70
    return made


def _legend_above(made: figure) -> None:
    made.add_layout(made.legend[0], "above")
    made.legend[0].orientation = "horizontal"
    made.legend[0].click_policy = "hide"
    made.legend[0].border_line_color = None


class TimeChart:
    """Measured and simulated over time, and below it the error with the noise band and the failing intervals."""

    def __init__(self) -> None:
        self.x = Range1d(0.0, 1.0)
        self.angle = _figure(260, "", "position", x_range=self.x)
        self.error = _figure(190, "time [s]", "error", x_range=self.x)
        self.simulated, self.beside = (ColumnDataSource({"t": [], "y": [], "e": []}) for _ in range(2))
        self.command, self.measured = (ColumnDataSource({"t": [], "y": []}) for _ in range(2))
        self.failing = ColumnDataSource({"x0": [], "x1": []})
        for made in (self.angle, self.error):
            made.vstrip(x0="x0", x1="x1", source=self.failing, fill_color=FAILING, line_color=None, level="underlay")
        lines = (
            (self.command, "command", FLOOR, "dotted"),
            (self.measured, "measured", MEASURED, "solid"),
            (self.beside, "other model", BEFORE, "dashed"),
            (self.simulated, "model", SIMULATED, "solid"),
        )
        for source, name, color, dash in lines:
            self.angle.line(
                "t", "y", source=source, color=color, line_dash=dash, legend_label=plain(name), line_width=1.5
            )
        for source, color, dash in ((self.beside, BEFORE, "dashed"), (self.simulated, ERROR, "solid")):
            self.error.line("t", "e", source=source, color=color, line_dash=dash, line_width=1.5)
        self.band = BoxAnnotation(fill_color=FLOOR, fill_alpha=0.2, level="underlay")
        self.error.add_layout(self.band)
        _legend_above(self.angle)
        for made in (self.angle, self.error):
            made.on_event(Tap, self._zoom_into)
        self._trial: Trial | None = None
        self._joint = 0

    def show(self, compared: Comparison, joint: int, beside: Array | None) -> None:
        """Draw one trial of a comparison, and the positions (n, joints) of another model beside it."""
        recording, trial = compared.recording, compared.recording.trials[0]
        unit = recording.units[recording.joints[joint]]
        if self._trial is not trial:
            self.x.update(start=0.0, end=trial.duration, reset_start=0.0, reset_end=trial.duration)
        self._trial, self._joint = trial, joint
        label(self.angle.yaxis[0], f"position [{unit}]")
        label(self.error.yaxis[0], f"error [{THOUSANDTHS[unit]}]")
        rows = self._rows()
        command = (
            trial.command[rows, joint] if not recording.torque_controlled else np.full(len(trial.time[rows]), np.nan)
        )
        self.command.data = {"t": trial.time[rows], "y": command}
        self.measured.data = {"t": trial.time[rows], "y": trial.position[rows, joint]}
        floor = 1e3 * compared.floor.joints[recording.joints[joint]]
        self.band.update(top=2.0 * floor, bottom=-2.0 * floor)
        failing = [one for one in compared.failing_intervals if one.joint == recording.joints[joint]]
        self.failing.data = {"x0": [one.start for one in failing], "x1": [one.end for one in failing]}
        self._draw(self.simulated, compared.simulated[0].position)
        if beside is None:
            self.beside.data = {"t": [], "y": [], "e": []}
        else:
            self._draw(self.beside, beside)

    def move(self, simulated: Array) -> None:
        """Draw other positions (n, joints) of the model."""
        self._draw(self.simulated, simulated)

    def zoom(self, start: float, end: float) -> None:
        """Show an interval with what is around it."""
        self.x.update(start=max(0.0, start - CONTEXT), end=min(end + CONTEXT, self.x.reset_end))

    def _draw(self, source: ColumnDataSource, position: Array) -> None:
        assert self._trial is not None
        error, rows = residuals([self._trial], [position])[0], self._rows()
        y, e = position[rows, self._joint], 1e3 * error[rows, self._joint]
        source.data = {"t": self._trial.time[rows], "y": y, "e": e}

    def _rows(self) -> slice:
        return slice(None, None, 1 + (0 if self._trial is None else len(self._trial.time) // DRAWN))

    def _zoom_into(self, event: Tap) -> None:
        for start, end in zip(self.failing.data["x0"], self.failing.data["x1"], strict=True):
            if start <= event.x <= end:
                self.zoom(start, end)


class MissingChart:
    """The torque that the model lacks over a signal: samples, mean over bins, and what a candidate would supply."""

    def __init__(self) -> None:
        self.figure = _figure(280, "", "missing torque", "pan,wheel_zoom,box_zoom,reset,save")
        self.points, self.mean, self.law = (ColumnDataSource({"x": [], "y": []}) for _ in range(3))
        self.figure.scatter("x", "y", source=self.points, size=2, color=FLOOR, alpha=0.3, legend_label="missing")
        self.figure.line("x", "y", source=self.mean, color=MEASURED, line_width=2.5, legend_label="its mean")
        self.figure.line(
            "x", "y", source=self.law, color=BEFORE, line_width=2.5, line_dash="dashed", legend_label="candidate's mean"
        )
        _legend_above(self.figure)

    def show(self, missing: Missing, signal: str, law: Missing | None, unit: str) -> None:
        """Draw it over one of its signals."""
        label(self.figure.xaxis[0], of_joint(signal, unit))
        lacks = of_joint("missing torque [N m]", unit)
        label(self.figure.yaxis[0], lacks.replace("torque", "force") if lacks.endswith("[N]") else lacks)
        some = slice(None, None, max(1, len(missing.torque) // POINTS))
        self.points.data = {"x": missing.signals[signal][some], "y": missing.torque[some]}
        self.mean.data = _curves(missing, signal)
        self.law.data = {"x": [], "y": []} if law is None else _curves(law, signal)


def signals(missing: Missing) -> list[str]:
    """Signals of a missing torque, the one that explains most first."""
    return list(dict.fromkeys(one.against.partition(", moving")[0] for one in shapes(missing)))


def _curves(missing: Missing, signal: str) -> dict[str, Array]:
    """Means over the bins of a signal, for either direction of motion where they differ; nan parts the curves."""
    known = [one for one in shapes(missing) if one.against.partition(", moving")[0] == signal]
    drawn = [one for one in known if one.against != signal] or known
    gap = np.array([np.nan])
    return {
        "x": np.concatenate([part for one in drawn for part in (one.centres, gap)]),
        "y": np.concatenate([part for one in drawn for part in (one.mean, gap)]),
    }


class ExperimentChart:
    """A proposed command beside the limits of the machine."""

    def __init__(self) -> None:
        self.range = Range1d()
        self.figure = _figure(220, "time [s]", "command", y_range=self.range)

    def show(self, experiment: Experiment, units: Sequence[str]) -> None:
        """Draw the commands of all joints, and what the limits less the margin allow as dashed lines."""
        self.figure.renderers, self.figure.center = [], [one for one in self.figure.center if not isinstance(one, Span)]
        label(self.figure.yaxis[0], f"command [{' or '.join(dict.fromkeys(units))}]")
        allowed = experiment.safety.allowed
        low, high = float(allowed.low.min()), float(allowed.high.max())
        self.range.update(start=low - 0.1 * (high - low), end=high + 0.1 * (high - low))
        for j, joint in enumerate(experiment.joints):
            color = PALETTE[j % len(PALETTE)]
            self.figure.line(experiment.time, experiment.commands[:, j], color=color, legend_label=plain(joint))
            for bound in (allowed.low[j], allowed.high[j]):
                self.figure.add_layout(Span(location=bound, dimension="width", line_color=color, line_dash="dashed"))
