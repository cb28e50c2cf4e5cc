import numpy as np
import pytest

from tactile_cube.drivetrain.laws import solve_speeds


def solve(M, b, limit, grip, v):
    n = len(b)
    out = np.array(v, dtype=float)
    solve_speeds(M, b, np.asarray(limit), np.asarray(grip), out, np.zeros(n), np.zeros((n, n)), np.zeros(n))
    return out


def random_case(rng, n, creeping):
    root = rng.normal(size=(n, n))
    M = root @ root.T + 0.1 * np.eye(n)
    limit = rng.uniform(0, 2, n) * (rng.random(n) < 0.8)
    grip = rng.uniform(0.1, 3, n) * (rng.random(n) < 0.5) * creeping
    return M, 2 * rng.normal(size=n), limit, grip, rng.normal(size=n) * (rng.random(n) < 0.7)


@pytest.mark.parametrize("creeping", [False, True])
@pytest.mark.parametrize("n", [1, 3, 6])
def test_friction_opposes_what_moves_and_holds_what_stands(n: int, creeping: bool) -> None:
    rng = np.random.default_rng(n)
    stood = moved = 0
    for _ in range(300):
        M, b, limit, grip, before = random_case(rng, n, creeping)
        v = solve(M, b, limit, grip, before)
        impulse = b - M @ v  # what friction took
        full = np.where(grip > 0, np.abs(v) * grip >= limit, v != 0.0)
        np.testing.assert_allclose(impulse[full], (limit * np.sign(v))[full], atol=1e-9)
        assert np.all(np.abs(impulse[~full]) <= limit[~full] + 1e-9)
        np.testing.assert_allclose(impulse[~full & (grip > 0)], (grip * v)[~full & (grip > 0)], atol=1e-9)
        stood, moved = stood + np.sum(~full), moved + np.sum(full)
    assert stood > 20
    assert moved > 20


def test_the_result_does_not_depend_on_the_first_guess() -> None:
    rng = np.random.default_rng(7)
    for _ in range(100):
        M, b, limit, grip, before = random_case(rng, 3, creeping=False)
        np.testing.assert_allclose(
            solve(M, b, limit, grip, before), solve(M, b, limit, grip, -before), rtol=1e-9, atol=1e-12
        )
