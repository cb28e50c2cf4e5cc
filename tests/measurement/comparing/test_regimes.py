from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from statsmodels.stats.diagnostic import acorr_ljungbox

from tactile_cube.measurement.comparing.error import summarise_errors
from tactile_cube.measurement.comparing.noise_floor import noise_floor
from tactile_cube.measurement.comparing.regimes import (
    after_reversal,
    cross_correlations,
    latest_direction,
    ljung_box,
    regimes,
    where_it_fails,
    whiteness,
)
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tests.measurement.small_rig import write


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    return read_recording(write(tmp_path))


def rows(recording: Recording, errors: list[np.ndarray], joint: str) -> dict[str, float]:
    return {row.regime: row.error for row in regimes(recording.trials, errors, recording.joints) if row.joint == joint}


def words(recording: Recording, errors: list[np.ndarray]) -> list[str]:
    table = regimes(recording.trials, errors, recording.joints)
    return where_it_fails(
        table, summarise_errors(errors, recording.joints).joints, noise_floor(recording), recording.units
    )


def test_an_error_after_reversals_stands_out_there(recording: Recording) -> None:
    errors = []
    for trial in recording.trials:
        error = 1e-4 * np.ones_like(trial.position)
        velocity = trial.velocity()[:, 0]
        error[:, 0] -= 0.005 * after_reversal(velocity, trial.step) * latest_direction(velocity)
        errors.append(error)
    table = rows(recording, errors, "a")
    assert table["just after reversals"] > 10 * table["away from reversals"]
    assert words(recording, errors)[0].startswith("a lags just after reversals, 5")


def test_an_error_in_proportion_to_speed_is_a_lag_that_grows_with_speed(recording: Recording) -> None:
    errors = [-0.003 * trial.velocity() * [0.0, 1.0] + 1e-5 for trial in recording.trials]
    table = rows(recording, errors, "b")
    assert table["medium speed"] > 3 * table["low speed"]
    assert words(recording, errors)[0].startswith("b lags ")


def test_an_error_of_one_posture_is_named(recording: Recording) -> None:
    errors = [0.004 * (trial.position > 0.25) * [0.0, 1.0] + 1e-5 for trial in recording.trials]
    table = rows(recording, errors, "b")
    assert table["high third of the range"] > 3 * table["middle third of the range"]
    assert "sits too high in the high third of the range" in words(recording, errors)[0]


def test_a_joint_at_the_floor_follows_the_model(recording: Recording) -> None:
    rng = np.random.default_rng(0)
    errors = [2e-4 * rng.normal(size=trial.position.shape) for trial in recording.trials]
    assert all("follows the model" in line for line in words(recording, errors))


def test_the_regimes_of_a_dimension_partition_the_samples(recording: Recording) -> None:
    parts: dict[str, list[float]] = {}
    for row in regimes(recording.trials, [trial.position * 0 for trial in recording.trials], recording.joints):
        if row.joint == "a":
            parts.setdefault(row.dimension, []).append(row.share)
    counts = {"speed": 3, "reversal": 2, "direction": 2, "load": 2, "posture": 3, "time": 3, "neighbours": 2, "kind": 1}
    assert {dimension: len(shares) for dimension, shares in parts.items()} == counts
    for dimension, shares in parts.items():
        few = 0.02 if dimension in ("speed", "direction") else 1e-9  # too few are too fast, or stand still
        assert 1.0 - few < sum(shares) < 1.0 + 1e-9
    assert parts["neighbours"][0] > 0.5, "the other joint moves most of the time"


def test_a_reversal_lasts_a_fifth_of_a_second() -> None:
    velocity = np.concatenate([np.ones(100), np.zeros(30), -np.ones(100)])
    assert np.flatnonzero(after_reversal(velocity, 0.01)).tolist() == list(range(130, 150))


def test_ljung_box_agrees_with_statsmodels() -> None:
    rng = np.random.default_rng(3)
    noise = rng.normal(size=500)
    coloured = noise + 0.1 * np.roll(noise, 1)
    for values in (noise, coloured):
        values = values - values.mean()
        assert ljung_box(values) == pytest.approx(acorr_ljungbox(values, lags=[20])["lb_pvalue"].iloc[0], rel=1e-6)


def test_white_noise_passes_and_a_slow_residual_fails(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    rng = np.random.default_rng(1)
    errors = [rng.normal(size=trial.position.shape) for trial in recording.trials]
    for error in errors:
        error[:, 1] = np.cumsum(error[:, 1])
    white, slow = whiteness(recording.trials, errors, recording.joints)
    assert white.p_value > 0.01
    assert slow.p_value < 1e-6
    assert slow.correlation_time > 5 * white.correlation_time


def test_a_residual_that_follows_a_velocity_is_traced_to_it_with_its_delay(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    rng = np.random.default_rng(1)
    errors = []
    for trial in recording.trials:
        error = 1e-3 * rng.normal(size=trial.position.shape)
        error[:, 0] += 0.01 * np.roll(trial.velocity()[:, 1], 5)
        errors.append(error)
    strongest = cross_correlations(recording.trials, errors, recording.joints)[0]
    assert (strongest.joint, strongest.cause) == ("a", "velocity of b")
    assert strongest.correlation > 0.9
    assert strongest.delay == pytest.approx(0.05, abs=0.021)
    assert strongest.p_value < 0.01


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_noise_goes_with_nothing_however_long_it_remembers_itself(tmp_path: Path, memory: float) -> None:
    recording = read_recording(write(tmp_path))
    rng, found = np.random.default_rng(2), []
    for _ in range(6):
        errors = [lfilter([1.0], [1.0, -memory], rng.normal(size=t.position.shape), axis=0) for t in recording.trials]
        found += [one.p_value for one in cross_correlations(recording.trials, errors, recording.joints)]
    assert min(found) > 1e-3, "of 120"
    assert np.mean(np.array(found) < 0.05) < 0.1
