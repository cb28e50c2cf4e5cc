import numpy as np
import pytest

from tactile_cube.identification.search.residual_starts import peaks


@pytest.mark.parametrize("harmonic", [6.0, 24.7, 91.0])
def test_the_strongest_peak_is_the_harmonic_that_was_put_in(harmonic: float) -> None:
    rng = np.random.default_rng(1)
    position = 0.9 * np.sin(np.linspace(0.0, 40.0, 6000)) + 0.2
    torque = 0.02 * np.sin(harmonic * position) - 0.01 * np.cos(harmonic * position)
    noisy = torque + 0.01 * rng.normal(size=len(position)) + 0.05 * position
    found, sine, cosine = peaks(position, noisy, np.ones_like(position), np.zeros(6000, dtype=np.int64))[0]
    assert found == pytest.approx(harmonic, abs=0.6)
    assert np.hypot(sine, cosine) == pytest.approx(np.hypot(0.02, 0.01), rel=0.35)
