from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.measurement.comparing.error import (
    failing_intervals,
    free_run_error,
    normalised_fit,
    raw_residuals,
    residuals,
    summarise_errors,
    with_fitted_offsets,
)
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.simulator import Simulator, free_run
from tests.measurement.small_rig import write


def test_the_offset_of_each_initialisation_is_removed_and_nothing_else(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    trials = recording.trials
    wave = 1e-3 * np.sin(np.linspace(0, 20 * np.pi, 300, endpoint=False))[:, None] * [1.0, 0.0]
    simulated = [t.position - wave + 0.02 * (t.initialisation + 1) for t in trials]
    summary = summarise_errors(residuals(trials, simulated), recording.joints)
    assert summary.joints["a"] == pytest.approx(1e-3 / np.sqrt(2), rel=1e-6)
    assert summary.joints["b"] == pytest.approx(0.0, abs=1e-12)
    assert summary.overall == pytest.approx(1e-3 / 2, rel=1e-6)


def test_bridged_samples_count_in_no_error(tmp_path: Path) -> None:
    recording = read_recording(
        write(tmp_path, spoil=lambda columns: columns.update({k: np.delete(v, 100) for k, v in columns.items()}))
    )
    simulated = [trial.position.copy() for trial in recording.trials]
    simulated[0][100] += 1.0
    errors = residuals(recording.trials, simulated)
    assert np.isnan(errors[0][100]).all()
    assert summarise_errors(errors, recording.joints).overall == 0.0


def test_of_the_raw_error_nothing_is_removed_and_the_fit_is_what_is_left_of_the_motion(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    trials = recording.trials
    raw = raw_residuals(trials, [trial.position + 0.02 for trial in trials])
    assert summarise_errors(raw, recording.joints).joints["a"] == pytest.approx(0.02)
    halves = [trial.position.mean(axis=0) + 0.5 * (trial.position - trial.position.mean(axis=0)) for trial in trials]
    assert normalised_fit(trials, raw_residuals(trials, halves), ("a", "b"))["a"] == pytest.approx(50.0)


STEP = 0.005


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Trials that the nominal model itself "measured", each initialisation with an offset of its own."""
    read = read_recording(write(tmp_path_factory.mktemp("recording")))
    nominal = nominal_model(read)
    true = {key: np.array([0.04, 0.0]) for key in nominal.offsets}
    made = free_run(read, replace(nominal, offsets=true), step=STEP)
    return read.with_trials(
        [replace(t, position=s.position, torque=s.torque) for t, s in zip(read.trials, made, strict=True)]
    )


def test_offsets_go_to_the_true_side_by_what_gravity_does_with_them_and_help(recording: Recording) -> None:
    simulator, nominal = Simulator(recording, step=STEP), nominal_model(recording)
    found = with_fitted_offsets(simulator, nominal)
    assert all(0.01 < offset[0] < 0.06 for offset in found.offsets.values())
    before, after = simulator.free_runs([nominal, found])
    assert free_run_error(recording, after).overall < free_run_error(recording, before).overall


def test_a_burst_is_found_where_it_is() -> None:
    time = np.arange(1000) / 100
    residual = 1e-4 * np.random.default_rng(0).normal(size=1000)
    assert failing_intervals("t", "a", time, residual, floor=1e-4) == [], "noise fails nowhere"
    residual[400:500] += 0.005
    (interval,) = failing_intervals("t", "a", time, residual, floor=1e-4)
    assert 3.8 < interval.start < 4.05
    assert 4.95 < interval.end < 5.2
    assert interval.error > 0.003
