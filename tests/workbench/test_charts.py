"""What is drawn, and that the legend names nothing else."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bokeh")

from bokeh.events import Tap

from tactile_cube.measurement.comparing.comparison import Comparison, describe_comparison
from tactile_cube.measurement.comparing.noise_floor import noise_floor
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.simulator import Simulated
from tactile_cube.workbench.charts import MissingChart, TimeChart
from tactile_cube.workbench.tables import error_of_trial
from tests.workbench.test_missing_torque import SPEED, missing


def compared(measured: Recording, mode: str = "position", **described: Any) -> Comparison:
    """A recording's first trial, beside itself 1 mrad further."""
    described["controller"] = measured.description.controller.model_copy(update={"mode": mode})
    recording = replace(measured, description=measured.description.model_copy(update=described))
    one = recording.with_trials(recording.trials[:1])
    further = Simulated(one.trials[0].position + 1e-3, np.zeros_like(one.trials[0].position))
    return describe_comparison(one, None, [further], noise_floor(recording), None, 0.002)


def named(chart: TimeChart) -> list[set[str]]:
    """Entries of the legends of error and position."""
    return [{item.label.value for item in made.legend[0].items if item.visible} for made in chart.figures[:2]]


def test_a_legend_names_what_is_drawn(measured: Recording) -> None:
    chart, found = TimeChart(), compared(measured)
    chart.show(found, 0, None)
    assert named(chart) == [{"model"}, {"command", "measured", "model"}]
    assert not chart.command.visible
    trial = found.recording.trials[0]
    chart.show(found, 0, trial.position, [(trial, trial.position)])
    assert named(chart) == [{"model", "other model", "other trials"}, {"command", "measured", "model", "other model"}]


def test_a_commanded_torque_has_an_axis_of_its_own(measured: Recording) -> None:
    chart, found = TimeChart(), compared(measured, "torque")
    chart.show(found, 0, None)
    assert named(chart)[1] == {"measured", "model"}
    assert chart.command.visible
    assert chart.command.yaxis[0].axis_label.text == "command [N m]"
    assert np.array_equal(chart.asked.data_source.data["y"], found.recording.trials[0].command[:, 0])


def test_degrees_stay_degrees(measured: Recording) -> None:
    found = compared(measured, shown_in={"a": "deg"})
    trial, chart, lacks = found.recording.trials[0], TimeChart(), MissingChart()
    chart.show(found, 0, None)
    assert [made.yaxis[0].axis_label.text for made in chart.figures[:2]] == ["error [deg]", "position [deg]"]
    assert np.allclose(chart.measured.data_source.data["y"], np.degrees(trial.position[:, 0]))
    assert np.allclose(chart.models[1][0].data_source.data["y"], np.degrees(trial.position[:, 0] + 1e-3))
    assert chart.band.top == pytest.approx(np.degrees(2.0 * found.floor.joints["a"]))
    assert " deg RMS of the free run" in error_of_trial(found, "a")
    lacks.show(missing(0.0), SPEED, None, found.recording.shown)
    assert lacks.figure.xaxis[0].axis_label.text == "velocity of a [deg/s]"
    assert lacks.figure.yaxis[0].axis_label.text == "missing torque [N m]"
    assert np.max(lacks.points.data_source.data["x"]) > 50.0


def test_a_click_into_a_failing_interval_zooms_to_it(measured: Recording) -> None:
    chart = TimeChart()
    chart.show(compared(measured), 0, None)
    chart.failing.data = {"x0": [1.0], "x1": [1.2]}
    chart._zoom_into(Tap(None, x=0.9))
    assert (chart.x.start, chart.x.end) == (0.0, chart.x.reset_end)
    chart._zoom_into(Tap(None, x=1.1))
    assert (chart.x.start, chart.x.end) == (0.5, 1.7)
