"""The search on small simulated machines: what is hidden is named, in a bounded number of simulations."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.criteria import Criteria
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.explanation import named_by
from tactile_cube.identification.search.findings import find, together
from tactile_cube.identification.search.proposals import failing_windows, press
from tactile_cube.identification.search.search import BestSoFar, Search
from tactile_cube.identification.verdict import decide
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import NOISE, Size, simulated

MOST_PATHS = 240  # exact simulations of a model in all windows of a problem; 30 of them look for twins


EFFECTS = tuple(find_effect(name) for name in ("payload", "torque_gain", "command_delay"))


@pytest.fixture(scope="module")
def heavier(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """An axis that carries 0.1 kg beside what is stated."""
    return simulated(tmp_path_factory.mktemp("r"), Size(slides=True), EFFECTS[0], {"mass": 0.1, "distance": 0.03})


def test_what_is_hidden_is_named_in_few_simulations(heavier: Recording) -> None:
    search = Search(*held_out_split(heavier), np.full(1, NOISE), EFFECTS, lambda line: None)
    paths, noted = search.shooting.path, []
    search.shooting.path = lambda model, windows: (noted.append(1), paths(model, windows))[1]  # type: ignore[method-assign]
    found = find(search)
    verdict = decide(found)
    assert verdict.kind == "missing_effect"
    assert named_by(verdict.chosen.effects) == {("payload", heavier.joints[0])}
    assert not found.stopped
    assert 0 < len(noted) < MOST_PATHS


def test_a_mass_that_a_torque_constant_imitates_exactly_is_named_with_it(tmp_path: Path) -> None:
    """A tenth more mass at the link's own centre moves as a drive does that gives a tenth less of everything."""
    recording = simulated(tmp_path, Size(), EFFECTS[0], {"mass": 0.02, "distance": 0.1})
    search = Search(*held_out_split(recording), np.full(1, NOISE), EFFECTS, lambda line: None)
    verdict = decide(find(search))
    named = {name for one in (verdict.chosen, *verdict.rivals) for name, _ in named_by(one.effects)}
    assert verdict.kind == "ambiguous"
    assert named == {"payload", "torque_gain"}


def test_a_search_that_may_simulate_little_ends_early_and_says_what_it_has_and_what_was_next(heavier) -> None:
    lines = list[str]()
    said = BestSoFar(lines.append)
    said.due = 0.0  # as if ten seconds had gone by
    criteria = Criteria(most_simulated=1.0)
    findings = find(Search(*held_out_split(heavier), np.full(1, NOISE), EFFECTS, said, criteria=criteria))
    assert findings.judged == ()
    assert findings.stopped == "every law by itself"
    said("anything")
    assert lines[-1].startswith("best answer so far: constants refitted (")
    assert lines[-1].endswith("; next: every law by itself")


def test_a_search_that_comes_nowhere_near_the_whole_looks_no_further(tmp_path: Path) -> None:
    """Play of 30 mrad among laws that take a tenth of it away: three laws more would leave too much as well."""
    recording = simulated(tmp_path, Size(), find_effect("backlash"), {"gap": 0.03})
    effects = tuple(find_effect(name) for name in ("coulomb_friction", "cogging", "transmission_error", "actuator_lag"))
    lines = list[str]()
    verdict = decide(find(Search(*held_out_split(recording), np.full(1, NOISE), effects, lines.append)))
    assert verdict.kind == "unknown_effect"
    assert [line for line in lines if " laws beside " in line][1:] == []


@pytest.mark.parametrize(
    ("hidden", "values", "beside"),
    [
        # coarse differences point the wrong way from the usual exponent of 2, and a drag took a part of the rest
        ("stribeck_friction", {"excess": 0.15, "velocity": 0.08, "exponent": 0.5}, "nonlinear_drag"),
        ("joint_stop", {"upper": 0.6, "stiffness": 3.0, "exponent": 2.0, "depth": 0.1}, "position_torque"),
    ],
)
def test_a_law_whose_details_are_not_the_usual_ones_is_named_alone(tmp_path: Path, hidden, values, beside) -> None:
    recording = simulated(tmp_path, Size(), find_effect(hidden), values)
    effects = tuple(find_effect(name) for name in (hidden, beside))
    verdict = decide(find(Search(*held_out_split(recording), np.full(1, NOISE), effects, lambda line: None)))
    assert verdict.kind == "missing_effect"
    assert named_by(verdict.chosen.effects) == {(hidden, recording.joints[0])}
    assert verdict.chosen.error < 1.1


def test_laws_are_tried_where_a_set_fails_most(heavier: Recording) -> None:
    search = Search(*held_out_split(heavier), np.full(1, NOISE), EFFECTS, lambda line: None)
    windows = search.problem.windows
    for window in (1, len(windows) - 2):
        residual = np.zeros_like(search.base.fit.residual)
        residual[window * windows.segments] = np.linspace(-5.0, 5.0, residual.shape[1])
        few = failing_windows(search, replace(search.base.fit, residual=residual))
        assert 0 < len(few) < len(windows)
        assert any(np.array_equal(one, windows.measured[window]) for one in few.measured)


def test_a_window_in_which_the_base_model_fails_most_is_fitted(heavier: Recording) -> None:
    fitted, held_out = held_out_split(heavier)
    noise, quiet = np.full(1, NOISE), lambda line: None
    before = Search(fitted, held_out, noise, EFFECTS, quiet, segments=24)
    every, few = before.all_windows, before.problem.windows
    unseen = next(k for k, one in enumerate(every.measured) if not any(np.array_equal(one, w) for w in few.measured))
    trials = list(fitted.trials)
    failing = trials[every.trial[unseen]]
    later = failing.time - every.time[unseen]
    bump = 0.2 * np.sin(np.pi * np.clip(later / 4.0 - 0.2, 0.0, 1.0)) ** 2
    trials[every.trial[unseen]] = replace(failing, position=failing.position + bump[:, None])
    search = Search(fitted.with_trials(trials), held_out, noise, EFFECTS, quiet, segments=24)
    assert search.base.largest_error > search.criteria.adequate
    now = search.all_windows.measured[unseen]
    assert any(np.array_equal(one, now) for one in search.problem.windows.measured)


def test_a_law_is_never_made_much_larger_than_its_own_steps_made_it() -> None:
    gram = np.full((2, 1, 1), 1.0)
    assert press(np.full((2, 1), 1.0), gram, 0.0) == pytest.approx(2.0), "as it is it takes away all that it changes"
    assert press(np.full((2, 1), 10.0), gram, 0.0) == pytest.approx(2 * (2 * 2.0 * 10.0 - 4.0)), "twice, not ten times"
    assert press(np.full((2, 1), -1.0), gram, 0.0) == 0.0, "and not turned round"


def test_of_one_law_at_many_joints_no_joint_is_taken_out_alone() -> None:
    delay, friction = (find_effect(name) for name in ("command_delay", "viscous_friction"))
    six = [Candidate(delay, (f"joint{k}",), {"delay": 0.02}) for k in range(6)]
    assert together(six[:4]) == [[0], [1], [2], [3]]
    assert together(six) == [[0, 1, 2, 3, 4, 5]]
    assert together([*six, Candidate(friction, ("joint0",), {"damping": 0.1})]) == [[0, 1, 2, 3, 4, 5], [6]]
