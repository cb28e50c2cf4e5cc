"""Standard errors against statsmodels' cluster-robust ones."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from statsmodels.api import OLS

from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.identification.fitting.resolution import standard_errors
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.measurement.comparing.noise_floor import of_one_command
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.replay.windows import cut
from tests.measurement.small_rig import write

SEGMENTS, ROWS = 30, 40
UNKNOWNS = tuple(Unknown("constant", key, 0, -np.inf, np.inf, 1.0) for key in ("kd", "kp"))


@pytest.mark.parametrize(("remembered", "alike"), [(0.0, 1), (3.0, 1), (3.0, 3)])
def test_errors_follow_the_scatter_of_segments_and_are_no_smaller_than_noise_as_large_as_the_residual_allows(
    remembered: float, alike: int
) -> None:
    rng = np.random.default_rng(0)
    groups = np.arange(SEGMENTS) // alike
    columns = rng.normal(size=(SEGMENTS, ROWS, 2)) + 1.0
    noise = 0.5 * rng.normal(size=(SEGMENTS, ROWS)) + remembered * rng.normal(size=(SEGMENTS, 1))[groups]
    flat = columns.reshape(-1, 2)
    ols = OLS(noise.ravel(), flat).fit()
    clusters = {"groups": np.repeat(groups, ROWS), "use_correction": False}
    count = SEGMENTS // alike
    robust = ols.get_robustcov_results("cluster", **clusters).bse * np.sqrt(count / (count - 2))
    information = flat.T @ flat
    left = ols.resid.reshape(SEGMENTS, ROWS)
    fitted = SimpleNamespace(
        residual=left, columns=columns, information=information, unknowns=UNKNOWNS, cost=np.sum(left**2)
    )
    problem = SimpleNamespace(free=np.asarray, weight=np.ones_like(left), alike=list(groups))
    found = standard_errors(problem, fitted)  # type: ignore[arg-type]
    white = np.sqrt(max(np.mean(left**2), 1.0) * np.diag(np.linalg.inv(information)))
    assert (robust > white).all() == (remembered > 0.0)
    np.testing.assert_allclose(found, np.maximum(robust, white), rtol=1e-6)


def test_two_long_segments_leave_no_interval_shorter_than_their_residual_does() -> None:
    """Of two segments and two unknowns the scores are none in the best fit, and so is their scatter."""
    rng = np.random.default_rng(0)
    columns, noise = rng.normal(size=(2, ROWS, 2)), 3.0 * rng.normal(size=(2, ROWS))
    flat = columns.reshape(-1, 2)
    left = (noise.ravel() - flat @ np.linalg.lstsq(flat, noise.ravel(), rcond=None)[0]).reshape(2, ROWS)
    fitted = SimpleNamespace(
        residual=left, columns=columns, information=flat.T @ flat, unknowns=UNKNOWNS, cost=np.sum(left**2)
    )
    problem = SimpleNamespace(free=np.asarray, weight=np.ones_like(left), alike=[0, 1])
    found = standard_errors(problem, fitted)  # type: ignore[arg-type]
    assert (found >= 2.5 * np.sqrt(np.diag(np.linalg.inv(flat.T @ flat)))).all()


def test_segments_of_repeats_err_alike_at_the_same_moment_of_their_command(tmp_path: Path) -> None:
    """A second trial begins two segments later in the command, a third one has another command."""
    recording = read_recording(write(tmp_path))
    shooting = Shooting(recording, ())
    windows = cut(recording, np.full(2, 1e-4))
    trials = shooting.recording.trials
    rows, count = windows.segment, windows.segments * np.count_nonzero(windows.trial == 0)
    assert Problem(shooting, windows).alike == 2 * list(range(count))
    shooting.command_of = {0: (0, 0), 1: (0, 2 * rows)}
    assert Problem(shooting, windows).alike == [*range(count), *range(2, count + 2)]
    shooting.command_of = {0: (0, 0), 1: (1, 0)}
    assert Problem(shooting, windows).alike == list(range(2 * count))
    assert of_one_command(trials) == [[(0, 0), (1, 0)]]
    moved = replace(trials[1], command=np.roll(trials[1].command, -5, axis=0))
    assert of_one_command([trials[0], moved]) == [[(0, 0), (1, 5)]]
    other = replace(trials[1], command=-trials[1].command)
    assert of_one_command([trials[0], other, trials[1]]) == [[(0, 0), (2, 0)], [(1, 0)]]
