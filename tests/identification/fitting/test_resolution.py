"""Steps of the simulation that the sensors call for."""

from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.identification.fitting import resolution
from tactile_cube.identification.fitting.problem import Shooting
from tactile_cube.identification.fitting.resolution import resolved, step_error
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import nominal_model
from tests.measurement.small_rig import write

EFFECTS = tuple(catalogue().values())  # one kernel is compiled for all tests


@pytest.mark.parametrize(("left", "rate"), [(0.19, None), (0.3, 1000.0), (0.7, 2000.0), (0.9, 4000.0), (40.0, 4000.0)])
def test_steps_are_as_short_as_the_error_that_they_leave_is_large(tmp_path, monkeypatch, left, rate) -> None:
    said: list[str] = []
    monkeypatch.setattr(resolution, "step_error", lambda *_: left)
    found = resolved(read_recording(write(tmp_path)), EFFECTS, said.append)
    assert found.description.controller.rate_hz == rate
    assert bool(said) == (rate is not None), "where steps become shorter it is said"


@pytest.mark.parametrize(
    ("left", "rate"),
    [
        ({500.0: 0.19}, 500.0),
        ({500.0: 0.21, 1000.0: 0.19}, 1000.0),
        ({500.0: 4.0, 1000.0: 2.0, 2000.0: 1.0}, 4000.0),  # no lower rate will do
    ],
)
def test_a_fast_controller_is_simulated_as_slowly_as_the_sensors_allow(tmp_path, monkeypatch, left, rate) -> None:
    said: list[str] = []
    stated = read_recording(write(tmp_path, lambda data: data["controller"].update(rate_hz=4000.0)))

    def error(recording: Recording, *rest: object) -> float:
        slower = recording.description.controller.rate_hz
        assert slower is not None
        assert rest[-1] == 4000.0 / slower, "beside the controller's own rate"
        return left[slower]

    monkeypatch.setattr(resolution, "step_error", error)
    assert resolved(stated, EFFECTS, said.append).description.controller.rate_hz == rate
    assert bool(said) == (rate != 4000.0)


@pytest.mark.parametrize("rate", [700.0, 200.0], ids=["neither 5 nor 6 steps a row divide into 7", "slow already"])
def test_a_rate_that_no_slower_one_divides_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rate: float) -> None:
    monkeypatch.setattr(resolution, "step_error", lambda *_: 0.0)
    stated = read_recording(write(tmp_path, lambda data: data["controller"].update(rate_hz=rate)))
    assert resolved(stated, EFFECTS, print) is stated


def test_a_torque_limit_that_is_reached_between_rows_needs_shorter_steps_where_the_encoder_is_fine(tmp_path) -> None:
    def error(limit: float, noise: float) -> float:
        def spoil(columns: dict[str, np.ndarray]) -> None:
            columns["a.command"] = 0.3 * np.sign(np.sin(2 * np.pi * 0.8 * columns["time"]))

        where = tmp_path / f"{limit}_{noise}"
        recording = read_recording(
            write(where, lambda data: data["controller"].update(kp=30.0, kd=1.0, torque_limit=limit), spoil)
        )
        shooting = Shooting(recording, EFFECTS)
        return step_error(recording, shooting, nominal_model(recording), np.full(2, noise), 8)

    assert error(0.3, 1e-6) > 1.5 * error(1e3, 1e-6)
    assert error(0.3, 1e-6) == pytest.approx(100 * error(0.3, 1e-4), rel=0.5)
