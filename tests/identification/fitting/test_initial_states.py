"""Integrals of controllers and bristles of friction, where a log begins out of balance or segments in the middle."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.measurement.replay.model import Model, Term, nominal_model
from tactile_cube.measurement.replay.simulator import integrated
from tests.identification.rigs_of_any_size import EFFECTS, NOISE, Size, simulated

INTEGRAL, PRESLIDING = find_effect("integral_action"), find_effect("presliding_friction")


@pytest.mark.parametrize("values", [{"ki": 2.0}, {"ki": 2.0, "lag": 0.06}])
def test_windows_that_begin_later_know_what_the_integral_has_come_to(values: dict[str, float], tmp_path: Path) -> None:
    wound = 0.04
    recording = simulated(tmp_path, Size(), INTEGRAL, values, wound=wound)
    shooting = Shooting(recording, EFFECTS)
    problem = Problem(shooting, shooting.cut(recording, np.array([NOISE]), segment=100))
    plain = nominal_model(recording)
    true = Model(plain.constants, (Term(INTEGRAL, "a", values, ()),), plain.offsets)
    problem.linearise_starts(true)
    assert problem.windows.wound == pytest.approx(wound, abs=0.2 * wound)
    later = np.repeat(problem.windows.time > 0.0, problem.windows.segments)

    def error() -> float:
        cost = problem.cost(problem.residual(problem.predictions([true])[0]))[later].sum()
        return float(np.sqrt(cost / np.count_nonzero(problem.weight[later])))

    assert error() < 1.5
    problem.windows = replace(problem.windows, errors=tuple(0.0 * one for one in problem.windows.errors))
    assert error() > 10.0
    assert problem.chosen_numbers(true).sum() == len(recording.trials), "one number was chosen for each trial"


@pytest.mark.parametrize(("limit", "damping", "carried"), [(0.3, 0.9, 0.0), (0.5, 1.0, 5.0)])
def test_no_wind_up_is_taken_that_fits_worse(limit: float, damping: float, carried: float, tmp_path: Path) -> None:
    values = {"ki": 2.0, "limit": limit}
    recording = simulated(tmp_path, Size(), INTEGRAL, values)
    shooting = Shooting(recording, EFFECTS)
    problem = Problem(shooting, shooting.cut(recording, np.array([NOISE])))
    plain = nominal_model(recording)
    constants = {**plain.constants, "kd": damping * plain.constants["kd"]}
    model = Model(constants, (Term(INTEGRAL, "a", values, ()),), plain.offsets)

    def costs() -> list[float]:
        each = problem.cost(problem.residual(problem.prediction(model)))
        return [each[problem.segment_trial == trial].sum() for trial in range(len(recording.trials))]

    problem.linearise_starts(model)
    problem.windows = replace(problem.windows, wound=np.zeros_like(problem.windows.wound))
    balanced = costs()
    problem.windows = replace(problem.windows, wound=problem.windows.wound + carried)
    problem.linearise_starts(model)
    for after, before in zip(costs(), balanced, strict=True):
        assert after <= before * (1.0 + 1e-9), "a clamp hides what is wound up beyond it"


@pytest.mark.parametrize("balanced", [True, False])
def test_bristles_begin_as_the_first_segments_say(balanced: bool, tmp_path: Path) -> None:
    values = {"breakaway": 0.01, "excess": 0.1}
    recording = simulated(tmp_path, Size(), PRESLIDING, values, balanced=balanced)
    shooting = Shooting(recording, EFFECTS)
    problem = Problem(shooting, shooting.cut(recording, np.array([NOISE])))
    plain = nominal_model(recording)
    true = Model(plain.constants, (Term(PRESLIDING, "a", values, ()),), plain.offsets)
    problem.linearise_starts(true)
    begun = problem.windows.balanced[problem.windows.time == 0.0, 0].tolist()
    assert begun[1::2] == [balanced, balanced], "triangles; as sines begin the load is balanced anyway"
    cost = problem.cost(problem.residual(problem.prediction(true))).sum()
    assert np.sqrt(cost / np.count_nonzero(problem.weight)) == pytest.approx(1.0, abs=0.1)


def test_an_integral_stops_at_its_limit_and_comes_back_at_once() -> None:
    errors = np.array([0.02, 0.02, 0.02, -0.01])
    assert integrated(errors, 0.01, 2.0, 0.0) == pytest.approx(0.11)
    assert integrated(errors, 0.01, 2.0, 0.06) == pytest.approx(0.04)
