import numpy as np

from tactile_cube.measurement.comparing.error import failing_intervals


def test_a_burst_is_found_where_it_is() -> None:
    time = np.arange(1000) / 100
    residual = 1e-4 * np.random.default_rng(0).normal(size=1000)
    residual[400:500] += 0.005
    (interval,) = failing_intervals("t", "a", time, residual, floor=1e-4)
    assert 3.8 < interval.start < 4.05
    assert 4.95 < interval.end < 5.2
    assert interval.error > 0.003


def test_noise_fails_nowhere() -> None:
    residual = 1e-4 * np.random.default_rng(0).normal(size=1000)
    assert failing_intervals("t", "a", np.arange(1000) / 100, residual, floor=1e-4) == []
