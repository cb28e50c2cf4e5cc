"""Standard errors against statsmodels' cluster-robust ones."""

from types import SimpleNamespace

import numpy as np
import pytest
from statsmodels.api import OLS

from tactile_cube.identification.fitting.intervals import standard_errors
from tactile_cube.identification.fitting.unknowns import Unknown

SEGMENTS, ROWS = 30, 40
UNKNOWNS = tuple(Unknown("constant", key, 0, -np.inf, np.inf, 1.0) for key in ("kd", "kp"))


@pytest.mark.parametrize("remembered", [0.0, 3.0])
def test_errors_follow_the_scatter_of_segments_and_are_no_smaller_than_the_sensors_noise_allows(
    remembered: float,
) -> None:
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(SEGMENTS, ROWS, 2)) + 1.0
    noise = 0.5 * rng.normal(size=(SEGMENTS, ROWS)) + remembered * rng.normal(size=(SEGMENTS, 1))
    flat = columns.reshape(-1, 2)
    ols = OLS(noise.ravel(), flat).fit()
    clusters = {"groups": np.repeat(np.arange(SEGMENTS), ROWS), "use_correction": False}
    robust = ols.get_robustcov_results("cluster", **clusters).bse * np.sqrt(SEGMENTS / (SEGMENTS - 2))
    information = flat.T @ flat
    fitted = SimpleNamespace(
        residual=ols.resid.reshape(SEGMENTS, ROWS), columns=columns, information=information, unknowns=UNKNOWNS
    )
    found = standard_errors(SimpleNamespace(free=np.asarray), fitted)  # type: ignore[arg-type]
    sensor_alone = np.sqrt(np.diag(np.linalg.inv(information)))
    assert (robust > sensor_alone).all() == (remembered > 0.0)
    np.testing.assert_allclose(found, np.maximum(robust, sensor_alone), rtol=1e-6)
