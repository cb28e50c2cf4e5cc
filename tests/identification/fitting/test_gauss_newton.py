import numpy as np
import pytest

from tactile_cube.identification.fitting.gauss_newton import bounded_step

INFORMATION = np.array([[4.0, 1.0], [1.0, 3.0]])
GRADIENT = np.array([1.0, 2.0])
FREE = np.full(2, np.inf)


def test_without_bounds_the_step_solves_the_normal_equations() -> None:
    step = bounded_step(INFORMATION, GRADIENT, 0.0, -FREE, FREE)
    assert INFORMATION @ step == pytest.approx(GRADIENT)


def test_a_bound_stops_one_unknown_and_the_other_is_solved_anew() -> None:
    step = bounded_step(INFORMATION, GRADIENT, 0.0, -FREE, np.array([np.inf, 0.1]))
    assert step[1] == 0.1
    assert step[0] == pytest.approx((GRADIENT[0] - 0.1) / 4.0)


def test_damping_shortens_the_step() -> None:
    full = bounded_step(INFORMATION, GRADIENT, 0.0, -FREE, FREE)
    damped = bounded_step(INFORMATION, GRADIENT, 10.0, -FREE, FREE)
    assert np.linalg.norm(damped) < 0.2 * np.linalg.norm(full)


def test_an_unknown_without_any_influence_stays() -> None:
    information = np.diag([2.0, 0.0])
    step = bounded_step(information, np.array([1.0, 0.0]), 1e-3, -FREE, FREE)
    assert step[1] == 0.0
