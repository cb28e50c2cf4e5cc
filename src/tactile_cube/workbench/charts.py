"""The pictures of a workbench, drawn by Bokeh in the colours of the reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from bokeh.events import Tap
from bokeh.models import (
    BoxAnnotation,
    ColumnDataSource,
    CrosshairTool,
    DataRange1d,
    GlyphRenderer,
    HoverTool,
    Range1d,
    Span,
)
from bokeh.plotting import figure
from numpy.typing import NDArray

from tactile_cube.identification.next_experiment import Experiment
from tactile_cube.identification.search.residual_shape import Missing
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.comparing.error import residuals
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.units import THOUSANDTHS, of_joint
from tactile_cube.visualization.charts import BEFORE, ERROR, FAILING, FLOOR, GRID, MEASURED, PALETTE, SIMULATED
from tactile_cube.workbench.missing_torque import curve
from tactile_cube.workbench.text import label, plain

Array = NDArray[np.float64]
TOOLS = "xpan,xwheel_zoom,box_zoom,reset,save"
POINTS, DRAWN = 1500, 20_000  # samples of the missing torque, and of a trial, that are drawn at most
CONTEXT = 0.5  # [s] shown on either side of a failing interval
NOTHING: Mapping[str, Sequence[float]] = {"t": [], "y": []}
SHOWN = (0.02, 0.98)  # quantiles of the missing torque between which it is shown


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


def _draw(made: figure, line: GlyphRenderer, data: Mapping[str, object]) -> None:
    """Give a line its data, and the legend an entry only where something of it is drawn."""
    line.data_source.data = dict(data)
    for item in made.legend[0].items if made.legend else []:
        if line in item.renderers:
            item.visible = len(next(iter(data.values()))) > 0  # type: ignore[arg-type]


class TimeChart:
    """The error over time with the noise band and the failing intervals; below it positions, and commanded torques."""

    def __init__(self) -> None:
        self.x = Range1d(0.0, 1.0)
        # the window of time decides what is shown of the other axis
        zooming = {"x_range": self.x, "window_axis": "x"}
        self.error = _figure(240, "", "error", y_range=DataRange1d(), **zooming)
        self.angle = _figure(220, "time [s]", "position", y_range=DataRange1d(), **zooming)
        self.command = _figure(140, "time [s]", "command", y_range=DataRange1d(), **zooming)
        self.figures = (self.error, self.angle, self.command)
        self.failing = ColumnDataSource({"x0": [], "x1": []})
        cursor = Span(dimension="height", line_color=FLOOR, line_dash="dotted")
        for made in self.figures[:2]:
            made.vstrip(x0="x0", x1="x1", source=self.failing, fill_color=FAILING, line_color=None, level="underlay")
        self.played, self.asked = (
            made.line("t", "y", source=ColumnDataSource(NOTHING), color=FLOOR, line_dash=dash, **more)
            for made, dash, more in (
                (self.angle, "dotted", {"legend_label": "command", "line_width": 1.5}),
                (self.command, "solid", {}),
            )
        )
        self.others = self.error.multi_line(
            "t", "y", source=ColumnDataSource(NOTHING), color=FLOOR, alpha=0.5, legend_label="other trials"
        )
        self.measured = self.angle.line(
            "t", "y", source=ColumnDataSource(NOTHING), color=MEASURED, legend_label="measured", line_width=1.5
        )
        self.models = [
            (
                self.angle.line(
                    "t",
                    "y",
                    source=ColumnDataSource(NOTHING),
                    color=below,
                    line_dash=dash,
                    legend_label=plain(name),
                    line_width=1.5,
                ),
                self.error.line(
                    "t",
                    "y",
                    source=ColumnDataSource(NOTHING),
                    color=above,
                    line_dash=dash,
                    legend_label=plain(name),
                    line_width=1.5,
                ),
            )
            for name, below, above, dash in (
                ("other model", BEFORE, SIMULATED, "dashed"),
                ("model", SIMULATED, ERROR, "solid"),
            )
        ]
        for made, lines in (
            (self.error, [self.models[1][1]]),
            (self.angle, [self.measured]),
            (self.command, [self.asked]),
        ):
            hover = HoverTool(renderers=lines, mode="vline", tooltips=[("time", "@t{0.000} s"), ("here", "@y{0.0000}")])
            made.add_tools(CrosshairTool(overlay=cursor, dimensions="height"), hover)
            made.on_event(Tap, self._zoom_into)
        self.band = BoxAnnotation(fill_color=FLOOR, fill_alpha=0.2, level="underlay")
        self.error.add_layout(self.band)
        _legend_above(self.error)
        _legend_above(self.angle)
        self._trial: Trial | None = None
        self._joint = 0

    def show(
        self, compared: Comparison, joint: int, beside: Array | None, others: Sequence[tuple[Trial, Array]] = ()
    ) -> None:
        """Draw one trial of a comparison.

        Args:
            compared: the model beside one trial.
            joint: which.
            beside: (n, joints) of another model.
            others: trials whose errors are drawn over it, with their simulated positions.
        """
        recording, trial = compared.recording, compared.recording.trials[0]
        name = recording.joints[joint]
        unit, torque = recording.units[name], recording.torque_controlled
        if self._trial is not trial:
            self.x.update(start=0.0, end=trial.duration, reset_start=0.0, reset_end=trial.duration)
        self._trial, self._joint = trial, joint
        label(self.angle.yaxis[0], f"position [{unit}]")
        label(self.error.yaxis[0], f"error [{THOUSANDTHS[unit]}]")
        label(self.command.yaxis[0], of_joint("command [N m]", unit))
        rows, nothing = self._rows(), NOTHING
        command = {"t": trial.time[rows], "y": trial.command[rows, joint]}
        _draw(self.angle, self.played, nothing if torque else command)
        _draw(self.command, self.asked, command if torque else nothing)
        self.command.visible = torque
        _draw(self.angle, self.measured, {"t": trial.time[rows], "y": trial.position[rows, joint]})
        floor = 1e3 * compared.floor.joints[name]
        self.band.update(top=2.0 * floor, bottom=-2.0 * floor)
        failing = [one for one in compared.failing_intervals if one.joint == name]
        self.failing.data = {"x0": [one.start for one in failing], "x1": [one.end for one in failing]}
        self.move(compared.simulated[0].position)
        self._draw_model(0, beside)
        errors = [(one, residuals([one], [position])[0][:, joint]) for one, position in others]
        thin = {"t": [one.time[self._rows(one)] for one, _ in errors]}
        _draw(self.error, self.others, thin | {"y": [1e3 * error[self._rows(one)] for one, error in errors]})

    def move(self, simulated: Array) -> None:
        """Draw other positions (n, joints) of the model."""
        self._draw_model(1, simulated)

    def zoom(self, start: float, end: float) -> None:
        """Show an interval with what is around it."""
        self.x.update(start=max(0.0, start - CONTEXT), end=min(end + CONTEXT, self.x.reset_end))

    def _draw_model(self, which: int, position: Array | None) -> None:
        angle, error = self.models[which]
        for made, line in ((self.angle, angle), (self.error, error)):
            if position is None or self._trial is None:
                _draw(made, line, NOTHING)
                continue
            values = position if made is self.angle else 1e3 * residuals([self._trial], [position])[0]
            _draw(made, line, {"t": self._trial.time[self._rows()], "y": values[self._rows(), self._joint]})

    def _rows(self, trial: Trial | None = None) -> slice:
        one = trial or self._trial
        return slice(None, None, 1 + (0 if one is None else len(one.time) // DRAWN))

    def _zoom_into(self, event: Tap) -> None:
        for start, end in zip(self.failing.data["x0"], self.failing.data["x1"], strict=True):
            if start <= event.x <= end:
                self.zoom(start, end)


class MissingChart:
    """The torque that the model lacks over a signal: its mean with an interval, and what a candidate would supply."""

    def __init__(self) -> None:
        self.y = Range1d()
        self.figure = _figure(280, "", "missing torque", "pan,wheel_zoom,box_zoom,reset,save", y_range=self.y)
        self.points, self.law = (ColumnDataSource({"x": [], "mean": []}) for _ in range(2))
        self.mean = ColumnDataSource({"x": [], "mean": [], "low": [], "high": []})
        drawn = self.figure
        drawn.scatter("x", "mean", source=self.points, size=2, color=FLOOR, alpha=0.25, legend_label="missing")
        drawn.varea("x", "low", "high", source=self.mean, fill_color=MEASURED, fill_alpha=0.2, legend_label="95 %")
        drawn.line("x", "mean", source=self.mean, color=MEASURED, line_width=2.5, legend_label="its mean")
        self.supplied = drawn.line(
            "x", "mean", source=self.law, color=BEFORE, line_width=2.5, line_dash="dashed", legend_label="candidate"
        )
        _legend_above(drawn)

    def show(self, missing: Missing, signal: str, law: Missing | None, unit: str) -> None:
        """Draw it over one of its signals."""
        label(self.figure.xaxis[0], of_joint(signal, unit))
        lacks = of_joint("missing torque [N m]", unit)
        label(self.figure.yaxis[0], lacks.replace("torque", "force") if lacks.endswith("[N]") else lacks)
        some = slice(None, None, max(1, len(missing.torque) // POINTS))
        self.points.data = {"x": missing.signals[signal][some], "mean": missing.torque[some]}
        found = curve(missing, signal)
        self.mean.data = {"x": found.x, "mean": found.mean, "low": found.low, "high": found.high}
        supplied = np.zeros((2, 0)) if law is None else np.stack(curve(law, signal)[:2])
        _draw(self.figure, self.supplied, {"x": supplied[0], "mean": supplied[1]})
        inside = [*np.quantile(missing.torque, SHOWN), *found.low, *found.high, *supplied[1]]
        low, high = np.nanmin(inside), np.nanmax(inside)
        self.y.update(start=low, end=high, reset_start=low, reset_end=high)


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
