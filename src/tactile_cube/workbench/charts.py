"""The pictures of a workbench, drawn by Bokeh in the colours of the reports."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from bokeh import models
from bokeh.events import Tap
from bokeh.plotting import figure

from tactile_cube.identification.next_experiment import Experiment
from tactile_cube.identification.search.residual_shape import Missing
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.comparing.error import residuals
from tactile_cube.measurement.recordings.trial import Array, Trial
from tactile_cube.measurement.units import SMALL, TURNS, named, shown
from tactile_cube.visualization.charts import BEFORE, ERROR, FAILING, FLOOR, GRID, MEASURED, PALETTE, SIMULATED
from tactile_cube.workbench.missing_torque import curve
from tactile_cube.workbench.text import label, plain

Points = Sequence[Any] | Array
TOOLS = "xpan,xwheel_zoom,box_zoom,reset,save"
POINTS, DRAWN = 1500, 20_000  # samples of the missing torque, and of a trial, that are drawn at most
CONTEXT = 0.5  # [s] shown on either side of a failing interval
SHOWN = (0.02, 0.98)  # quantiles of the missing torque between which it is shown


def _figure(height: int, x: str, y: str, tools: str = TOOLS, **more: object) -> figure:
    made = figure(height=height, sizing_mode="stretch_width", tools=tools, **more)
    label(made.xaxis[0], x)
    label(made.yaxis[0], y)
    made.yaxis.formatter = models.PrintfTickFormatter(format="%.4g")
    made.toolbar.logo = None
    made.grid.grid_line_color = GRID
    made.outline_line_color = None
    made.min_border_left = 70
    return made


def _line(made: figure, name: str, color: str, kind: str = "line", **more: Any) -> models.GlyphRenderer:
    """Draw a line, or several, without data; `name` is its label in the legend."""
    drawn: models.GlyphRenderer = getattr(made, kind)(
        "x", "y", source=models.ColumnDataSource({"x": [], "y": []}), color=color, legend_label=plain(name), **more
    )
    return drawn


def _legend_above(made: figure) -> None:
    made.add_layout(made.legend[0], "above")
    made.legend[0].update(orientation="horizontal", click_policy="hide", border_line_color=None)


def _draw(
    made: figure, line: models.GlyphRenderer, x: Sequence[Any] | Array = (), y: Sequence[Any] | Array = ()
) -> None:
    """Give a line its data, and the legend an entry only where something of it is drawn."""
    line.data_source.data = {"x": x, "y": y}
    for item in made.legend[0].items if made.legend else []:
        if line in item.renderers:
            item.visible = len(x) > 0


class TimeChart:
    """The error over time with the noise band and the failing intervals; below it positions, and commanded torques."""

    def __init__(self) -> None:
        self.x = models.Range1d(0.0, 1.0)
        # the window of time decides what is shown of the other axis
        self.error, self.angle, self.command = self.figures = tuple(
            _figure(height, axis, "", y_range=models.DataRange1d(), x_range=self.x, window_axis="x")
            for height, axis in ((240, ""), (220, "time [s]"), (140, "time [s]"))
        )
        self.played = _line(self.angle, "command", FLOOR, line_dash="dotted", line_width=1.5)
        self.asked = self.command.line("x", "y", source=models.ColumnDataSource({"x": [], "y": []}), color=FLOOR)
        self.others = _line(self.error, "other trials", FLOOR, "multi_line", alpha=0.5)
        self.measured = _line(self.angle, "measured", MEASURED, line_width=1.5)
        self.models = [
            [
                _line(made, name, color, line_dash=dash, line_width=1.5)
                for made, color in ((self.angle, below), (self.error, above))
            ]
            for name, dash, below, above in (
                ("other model", "dashed", BEFORE, SIMULATED),
                ("model", "solid", SIMULATED, ERROR),
            )
        ]
        self.failing = models.ColumnDataSource({"x0": [], "x1": []})
        cursor = models.Span(dimension="height", line_color=FLOOR, line_dash="dotted")
        for made, line in zip(self.figures, (self.models[1][1], self.measured, self.asked), strict=True):
            hover = models.HoverTool(
                renderers=[line], mode="vline", tooltips=[("time", "@x{0.000} s"), ("here", "@y{0.0000}")]
            )
            made.add_tools(models.CrosshairTool(overlay=cursor, dimensions="height"), hover)
            made.on_event(Tap, self._zoom_into)
            made.vstrip(x0="x0", x1="x1", source=self.failing, fill_color=FAILING, line_color=None, level="underlay")
        self.band = models.BoxAnnotation(fill_color=FLOOR, fill_alpha=0.2, level="underlay")
        self.error.add_layout(self.band)
        _legend_above(self.error)
        _legend_above(self.angle)
        self._trial: Trial | None = None
        self._joint, self._unit = 0, TURNS

    def show(
        self, compared: Comparison, joint: int, beside: Array | None, others: Sequence[tuple[Trial, Array]] = ()
    ) -> None:
        """Draw a joint of a model beside one trial, another model's positions (n, joints), errors of other trials."""
        recording, trial = compared.recording, compared.recording.trials[0]
        name = recording.joints[joint]
        if self._trial is not trial:
            self.x.update(start=0.0, end=trial.duration, reset_start=0.0, reset_end=trial.duration)
        self._trial, self._joint, self._unit = trial, joint, recording.shown[name]
        position, size = shown("position [rad]", self._unit)
        error, small = SMALL[self._unit]
        label(self.angle.yaxis[0], position)
        label(self.error.yaxis[0], f"error [{error}]")
        label(self.command.yaxis[0], shown("command [N m]", self._unit)[0])
        time, command = trial.time[_rows(trial)], trial.command[_rows(trial), joint]
        self.command.visible = torque = recording.torque_controlled
        _draw(self.angle, self.played, *(((), ()) if torque else (time, size * command)))
        _draw(self.command, self.asked, *((time, command) if torque else ((), ())))
        _draw(self.angle, self.measured, time, size * trial.position[_rows(trial), joint])
        band = 2.0 * small * compared.floor.joints[name]
        self.band.update(top=band, bottom=-band)
        failing = [one for one in compared.failing_intervals if one.joint == name]
        self.failing.data = {"x0": [one.start for one in failing], "x1": [one.end for one in failing]}
        self.move(compared.simulated[0].position)
        self._draw_model(0, beside)
        errors = [small * residuals([one], [position])[0][_rows(one), joint] for one, position in others]
        _draw(self.error, self.others, [one.time[_rows(one)] for one, _ in others], errors)

    def move(self, simulated: Array) -> None:
        """Draw other positions (n, joints) of the model."""
        self._draw_model(1, simulated)

    def zoom(self, start: float, end: float) -> None:
        """Show an interval with what is around it."""
        self.x.update(start=max(0.0, start - CONTEXT), end=min(end + CONTEXT, self.x.reset_end))

    def _draw_model(self, which: int, position: Array | None) -> None:
        angle, error = self.models[which]
        if position is None or self._trial is None:
            _draw(self.angle, angle)
            _draw(self.error, error)
            return
        rows, joint = _rows(self._trial), self._joint
        time, left = self._trial.time[rows], residuals([self._trial], [position])[0]
        _draw(self.angle, angle, time, shown("[rad]", self._unit)[1] * position[rows, joint])
        _draw(self.error, error, time, SMALL[self._unit][1] * left[rows, joint])

    def _zoom_into(self, event: Tap) -> None:
        for start, end in zip(self.failing.data["x0"], self.failing.data["x1"], strict=True):
            if start <= event.x <= end:
                self.zoom(start, end)


def _rows(trial: Trial) -> slice:
    return slice(None, None, 1 + len(trial.time) // DRAWN)


class MissingChart:
    """The torque that the model lacks over a signal: its mean with an interval, and what a candidate would supply."""

    def __init__(self) -> None:
        self.y = models.Range1d()
        self.figure = drawn = _figure(280, "", "missing torque", "pan,wheel_zoom,box_zoom,reset,save", y_range=self.y)
        self.points = _line(drawn, "missing", FLOOR, "scatter", size=2, alpha=0.25)
        self.band = models.ColumnDataSource({"x": [], "low": [], "high": []})
        drawn.varea("x", "low", "high", source=self.band, fill_color=MEASURED, fill_alpha=0.2, legend_label="95 %")
        self.mean = _line(drawn, "its mean", MEASURED, line_width=2.5)
        self.supplied = _line(drawn, "candidate", BEFORE, line_width=2.5, line_dash="dashed")
        _legend_above(drawn)

    def show(self, missing: Missing, signal: str, law: Missing | None, units: Mapping[str, str]) -> None:
        """Draw it over one of its signals; `units`: joint -> unit in which its position is shown."""
        x, size = named(signal, units)
        label(self.figure.xaxis[0], x)
        lacks, _ = shown("missing torque [N m]", units[missing.joint])
        label(self.figure.yaxis[0], lacks.replace("torque", "force") if lacks.endswith("[N]") else lacks)
        some = slice(None, None, max(1, len(missing.torque) // POINTS))
        _draw(self.figure, self.points, size * missing.signals[signal][some], missing.torque[some])
        found = curve(missing, signal)
        self.band.data = {"x": size * found.x, "low": found.low, "high": found.high}
        _draw(self.figure, self.mean, size * found.x, found.mean)
        supplied = np.zeros((2, 0)) if law is None else np.stack(curve(law, signal)[:2])
        _draw(self.figure, self.supplied, size * supplied[0], supplied[1])
        inside = [*np.quantile(missing.torque, SHOWN), *found.low, *found.high, *supplied[1]]
        low, high = np.nanmin(inside), np.nanmax(inside)
        self.y.update(start=low, end=high, reset_start=low, reset_end=high)


class ExperimentChart:
    """A proposed command beside the limits of the machine."""

    def __init__(self) -> None:
        self.range = models.Range1d()
        self.figure = _figure(220, "time [s]", "command", y_range=self.range)

    def show(self, experiment: Experiment, units: Sequence[str]) -> None:
        """Draw the commands of all joints as their file has them, and what the limits allow as dashed lines."""
        drawn = self.figure
        drawn.renderers, drawn.center = [], [one for one in drawn.center if not isinstance(one, models.Span)]
        label(drawn.yaxis[0], f"command [{' or '.join(dict.fromkeys(units))}]")
        allowed = experiment.safety.allowed
        low, high = float(allowed.low.min()), float(allowed.high.max())
        self.range.update(start=low - 0.1 * (high - low), end=high + 0.1 * (high - low))
        for j, joint in enumerate(experiment.joints):
            color = PALETTE[j % len(PALETTE)]
            drawn.line(experiment.time, experiment.commands[:, j], color=color, legend_label=plain(joint))
            for bound in (allowed.low[j], allowed.high[j]):
                drawn.add_layout(models.Span(location=bound, dimension="width", line_color=color, line_dash="dashed"))
