"""One step within bounds, and when a fit has ended."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.fitting import gauss_newton
from tactile_cube.identification.fitting.gauss_newton import bounded_step, fit
from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.identification.fitting.unknowns import offset_unknowns
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.measurement.replay.model import Model, nominal_model
from tests.identification.rigs_of_any_size import NOISE, Size, simulated

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


def dragged(folder: Path, damping: float) -> tuple[Problem, Candidate]:
    """A joint with viscous friction, and that law at another damping [N m s/rad]."""
    viscous = find_effect("viscous_friction")
    recording = simulated(folder, Size(), viscous, {"damping": 0.08})
    shooting = Shooting(recording, (viscous,))
    problem = Problem(shooting, shooting.cut(recording, np.full(1, NOISE)))
    return problem, Candidate(viscous, tuple(recording.joints), {"damping": damping}, shooting.sizes)


def test_a_fit_that_begins_far_off_does_not_end_by_what_it_began_with(tmp_path: Path) -> None:
    """While the error is large what is expected weighs much, and a first step that gains nearly all stops half way."""
    problem, law = dragged(tmp_path, 0.08)
    true, _ = law.added_to(nominal_model(problem.shooting.recording))
    offsets = offset_unknowns(problem.shooting.recording, problem.shooting.sizes)
    unknowns = [replace(one, centre=0.02) for one in offsets]
    problem.linearise_starts(true)
    near = fit(problem, true, unknowns)
    far = true
    for one in unknowns:
        far = one.put(far, 0.045)
    problem.linearise_starts(far)
    found = fit(problem, far, unknowns)
    assert found.settled
    assert found.cost == pytest.approx(near.cost, rel=0.02)


def test_a_fit_whose_last_step_gained_what_it_promised_takes_no_new_derivatives_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, law = dragged(tmp_path, 0.083)
    model, unknowns = law.added_to(nominal_model(problem.shooting.recording))
    problem.linearise_starts(model)
    taken: list[Model] = []
    columns = problem.columns
    monkeypatch.setattr(problem, "columns", lambda at, *how: taken.append(at) or columns(at, *how))
    found = fit(problem, model, unknowns, iterations=8)
    assert found.settled
    assert unknowns[0].of(found.model) == pytest.approx(0.08, rel=0.02)
    first = len(taken)
    monkeypatch.setattr(gauss_newton, "KEPT", np.inf)
    again = fit(problem, model, unknowns, iterations=8)
    assert first < len(taken) - first
    assert again.cost == pytest.approx(found.cost, rel=gauss_newton.CONVERGED)
