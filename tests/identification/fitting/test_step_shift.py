"""What a world in finer steps does to values that are fitted in coarse ones, and whether that is foreseen."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.identification.fitting.resolution import FINER, bounds, final_fit, finer
from tactile_cube.identification.fitting.unknowns import base_unknowns, read_all
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.windows import Windows, cut
from tests.measurement.small_rig import write

NOISE, SMALL = np.full(2, 1e-4), np.full(2, 1e-6)
EFFECTS = tuple(catalogue().values())  # one kernel is compiled for all tests


def read(folder: Path, rate: float = 100.0) -> Recording:
    return read_recording(write(folder, lambda data: data["controller"].update(rate_hz=rate)))


@pytest.mark.parametrize("rate", [100.0, 500.0])
def test_finer_windows_are_those_of_a_faster_controller(tmp_path: Path, rate: float) -> None:
    coarse, fast = (cut(read(tmp_path / str(k), k), NOISE) for k in (rate, 4.0 * 500.0))
    fine = finer(coarse, fast.substeps // coarse.substeps)
    first = fine.history * fine.substeps
    assert fine.substeps == fast.substeps
    np.testing.assert_allclose(fine.commands[:, first:], fast.commands[:, first:], atol=1e-12)


def test_where_a_row_is_one_step_the_jump_tells_the_later_command(tmp_path: Path) -> None:
    def slow(folder: Path, rate: float) -> Windows:
        return cut(read(folder, rate), NOISE, time=10.0)  # a slow machine, whose rows need no finer steps

    coarse, fast = slow(tmp_path / "a", 100.0), slow(tmp_path / "b", 400.0)
    assert (coarse.substeps, fast.substeps) == (1, 4)
    first = fast.history * fast.substeps
    np.testing.assert_allclose(finer(coarse, 4).commands[:, first:], fast.commands[:, first:], atol=1e-12)


def test_the_interval_reaches_from_the_value_of_coarse_steps_to_that_of_the_finer_world(tmp_path: Path) -> None:
    recording = read(tmp_path)
    shooting, truth = Shooting(recording, EFFECTS), nominal_model(recording)
    windows = cut(recording, SMALL, segment=40)
    world = shooting.finer(FINER).positions([truth], finer(windows, FINER))[0]
    problem = Problem(shooting, replace(windows, measured=world))
    unknowns = base_unknowns(recording, truth.constants, shooting.sizes)
    sure = [one for one in unknowns if one.key != "reading_delay"]  # which would take the step's error for its own
    fitted = final_fit(problem, truth, sure)
    unknowns = fitted.fit.unknowns
    error = read_all(truth, unknowns) - read_all(fitted.model, unknowns)
    assert np.any(np.abs(error) > 1.5 * fitted.half_width), "the residual does not show what the step does"
    assert np.all(np.abs(error - fitted.step_shift) < fitted.half_width)
    for (value, low, high), true in zip(bounds(fitted).values(), read_all(truth, unknowns), strict=True):
        assert low <= min(value, true)
        assert max(value, true) <= high
