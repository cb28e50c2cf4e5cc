"""What is drawn, and that the legend names nothing else."""

from pathlib import Path

import numpy as np
import pytest
import yaml

pytest.importorskip("bokeh")

from bokeh.events import Tap

from tactile_cube.measurement.comparing.comparison import Comparison, describe_comparison
from tactile_cube.measurement.comparing.noise_floor import noise_floor
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.replay.simulator import Simulated
from tactile_cube.workbench.charts import MissingChart, TimeChart
from tactile_cube.workbench.tables import error_of_trial
from tests.workbench.small_bench import stribeck_recording
from tests.workbench.test_missing_torque import SPEED, missing


def compared(folder: Path, mode: str) -> Comparison:
    """A recording's first trial, beside itself 1 mrad further."""
    stribeck_recording(folder)
    described = yaml.safe_load((folder / "recording.yaml").read_text())
    described["controller"]["mode"] = mode
    (folder / "recording.yaml").write_text(yaml.safe_dump(described))
    recording = read_recording(folder)
    one = recording.with_trials(recording.trials[:1])
    further = Simulated(one.trials[0].position + 1e-3, np.zeros_like(one.trials[0].position))
    return describe_comparison(one, None, [further], noise_floor(recording), None, 0.002)


def named(chart: TimeChart) -> list[set[str]]:
    """Entries of the legends of error and position."""
    return [{item.label.value for item in made.legend[0].items if item.visible} for made in chart.figures[:2]]


def test_a_legend_names_what_is_drawn(tmp_path: Path) -> None:
    chart, found = TimeChart(), compared(tmp_path, "position")
    chart.show(found, 0, None)
    assert named(chart) == [{"model"}, {"command", "measured", "model"}]
    assert not chart.command.visible
    trial = found.recording.trials[0]
    chart.show(found, 0, trial.position, [(trial, trial.position)])
    assert named(chart) == [{"model", "other model", "other trials"}, {"command", "measured", "model", "other model"}]


def test_a_commanded_torque_has_an_axis_of_its_own(tmp_path: Path) -> None:
    chart, found = TimeChart(), compared(tmp_path, "torque")
    chart.show(found, 0, None)
    assert named(chart)[1] == {"measured", "model"}
    assert chart.command.visible
    assert chart.command.yaxis[0].axis_label.text == "command [N m]"
    assert np.array_equal(chart.asked.data_source.data["y"], found.recording.trials[0].command[:, 0])


def test_degrees_stay_degrees(tmp_path: Path) -> None:
    compared(tmp_path, "position")
    described = yaml.safe_load((tmp_path / "recording.yaml").read_text()) | {"shown_in": {"a": "deg"}}
    (tmp_path / "recording.yaml").write_text(yaml.safe_dump(described))
    recording = read_recording(tmp_path)
    one, trial = recording.with_trials(recording.trials[:1]), recording.trials[0]
    further = Simulated(trial.position + 1e-3, np.zeros_like(trial.position))
    found = describe_comparison(one, None, [further], noise_floor(recording), None, 0.002)
    chart, lacks = TimeChart(), MissingChart()
    chart.show(found, 0, None)
    assert [made.yaxis[0].axis_label.text for made in chart.figures[:2]] == ["error [deg]", "position [deg]"]
    assert np.allclose(chart.measured.data_source.data["y"], np.degrees(trial.position[:, 0]))
    assert np.allclose(chart.models[1][0].data_source.data["y"], np.degrees(trial.position[:, 0] + 1e-3))
    assert chart.band.top == pytest.approx(np.degrees(2.0 * found.floor.joints["a"]))
    assert " deg RMS of the free run" in error_of_trial(found, "a")
    lacks.show(missing(0.0), SPEED, None, recording.shown)
    assert lacks.figure.xaxis[0].axis_label.text == "velocity of a [deg/s]"
    assert lacks.figure.yaxis[0].axis_label.text == "missing torque [N m]"
    assert np.max(lacks.points.data_source.data["x"]) > 50.0


def test_a_click_into_a_failing_interval_zooms_to_it(tmp_path: Path) -> None:
    chart = TimeChart()
    chart.show(compared(tmp_path, "position"), 0, None)
    chart.failing.data = {"x0": [1.0], "x1": [1.2]}
    chart._zoom_into(Tap(None, x=0.9))
    assert (chart.x.start, chart.x.end) == (0.0, chart.x.reset_end)
    chart._zoom_into(Tap(None, x=1.1))
    assert (chart.x.start, chart.x.end) == (0.5, 1.7)
