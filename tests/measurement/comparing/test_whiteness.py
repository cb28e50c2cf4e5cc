from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from statsmodels.stats.diagnostic import acorr_ljungbox

from tactile_cube.measurement.comparing.regimes import cross_correlations, ljung_box, whiteness
from tactile_cube.measurement.recordings.reading import read_recording
from tests.measurement.small_rig import write


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
