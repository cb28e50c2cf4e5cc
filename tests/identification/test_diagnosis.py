"""What a diagnosis recommends, and which effects a recording could not show, were they there."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import catalogue, find_effect
from tactile_cube.drivetrain.effects.effect import FINGER
from tactile_cube.identification.diagnosis import Unseen, no_worse, unseen
from tactile_cube.identification.fitting.gauss_newton import fit
from tactile_cube.identification.in_words import unseen_effects
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.standard_model import fit_standard_model
from tactile_cube.identification.verdict import Simulations, Verdict
from tactile_cube.measurement.comparing.noise_floor import noise_floor
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import NOISE, Size, simulated

SATURATION, STOP = find_effect("torque_saturation"), find_effect("joint_stop")


@pytest.mark.parametrize(("limit", "why"), [(0.75, None), (1.0, "asked for up to 0.7 of 1 N m"), (float("inf"), None)])
def test_a_lower_torque_limit_shows_where_the_stated_one_is_nearly_reached(limit: float, why: str | None) -> None:
    assert SATURATION.unseen_at(replace(FINGER, torque_limit=limit)) == why


@pytest.mark.parametrize(
    ("ends", "why"),
    [
        ((-0.05, 1.3), None),
        ((-0.3, 1.3), "moved from 0 to 1.2 of -0.3 to 1.3 rad"),
        ((-0.05, 1.5), "moved from 0 to 1.2 of -0.05 to 1.5 rad"),
        ((-float("inf"), float("inf")), "moved from 0 to 1.2 rad"),
    ],
)
def test_a_stop_shows_where_both_ends_are_visited(ends: tuple[float, float], why: str | None) -> None:
    assert STOP.unseen_at(replace(FINGER, lower=ends[0], upper=ends[1])) == why


def test_an_axis_that_slides_says_so_in_its_own_units() -> None:
    axis = replace(FINGER, slides=True, torque_limit=200.0, seldom=35.0)
    assert SATURATION.unseen_at(axis) == "asked for up to 35 of 200 N"


def test_the_ends_and_the_limit_are_those_of_urdf_and_controller(tmp_path: Path) -> None:
    recording = simulated(tmp_path, Size(), find_effect("viscous_friction"), {"damping": 0.08})
    (scales,), tree = joint_scales(recording), recording.rigid_body()
    assert (scales.lower, scales.upper) == (tree.lower[0], tree.upper[0])
    assert scales.torque_limit == recording.gains.torque_limit[0]


def test_what_was_seen_all_the_same_is_not_listed() -> None:
    sizes = {"q1": replace(FINGER, torque_limit=2.0), "q2": replace(FINGER, torque_limit=2.0)}
    found = unseen(tuple(catalogue().values()), sizes, ["torque_saturation@q1", "joint_stop@q1", "joint_stop@q2"])
    assert found == (Unseen("torque_saturation", "q2", "asked for up to 0.7 of 2 N m"),)


def test_an_effect_is_told_once_with_all_its_joints() -> None:
    entries = [Unseen("joint_stop", joint, f"moved {joint}")._asdict() for joint in ("q1", "q2")]
    assert unseen_effects({"unseen": entries}) == [
        "These trials cannot reveal joint_stop at q1 (moved q1), q2 (moved q2)."
    ]
    assert unseen_effects({}) == []


def test_nothing_that_claims_to_be_all_is_recommended_where_the_standard_model_follows_better(tmp_path: Path) -> None:
    payload = find_effect("payload")
    recording = simulated(tmp_path, Size(), payload, {"mass": 0.02, "distance": 0.1})
    noise, parts = np.full(1, NOISE), held_out_split(recording)
    search = Search(*parts, noise, (payload,), lambda line: None)
    standard = fit_standard_model(*parts, noise, effects=(payload,))
    simulations = Simulations(search, search.base, noise_floor(recording))
    wrong, nothing = Verdict("missing_effect", search.base), Verdict("adequate", search.base)
    verdict = no_worse(wrong, standard, search, simulations, search.free_runs)
    assert verdict.kind == "unknown_effect"
    assert verdict.chosen.fit.model == standard.model
    assert no_worse(nothing, standard, search, simulations, search.free_runs) == nothing


def test_where_both_leave_something_the_standard_model_stands_unless_a_richer_one_beats_it(
    tmp_path: Path,
) -> None:
    hidden = find_effect("cogging")
    recording = simulated(tmp_path, Size(), hidden, {"sine": 0.05, "cosine": 0.0, "harmonic": 7.0})
    noise, parts = np.full(1, NOISE), held_out_split(recording)
    more = Candidate(find_effect("torque_bias"), tuple(recording.joints), {"bias": 0.0})
    search = Search(*parts, noise, (hidden, more.effect), lambda line: None)
    standard = fit_standard_model(*parts, noise, effects=(hidden, more.effect))
    simulations = Simulations(search, search.base, noise_floor(recording))
    model, _ = more.added_to(standard.model)
    chosen = Explanation(
        (*standard.effects, more),
        fit(search.problem, model, search.unknowns(model), iterations=0),
        search.judged(model),
        0.0,
        0.5,
    )
    verdict = no_worse(Verdict("partly_explained", chosen), standard, search, simulations, search.free_runs)
    assert (verdict.kind, verdict.chosen.effects) == ("unknown_effect", standard.effects)
    whole = Verdict("missing_effect", chosen)
    assert no_worse(whole, standard, search, simulations, search.free_runs) == whole


def test_what_whole_trials_and_segments_prefer_of_two_complete_models_cannot_be_told_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    payload = find_effect("payload")
    recording = simulated(tmp_path, Size(), payload, {"mass": 0.02, "distance": 0.1})
    noise, parts = np.full(1, NOISE), held_out_split(recording)
    hidden = Candidate(payload, tuple(recording.joints), {"mass": 0.02, "distance": 0.1})
    search = Search(*parts, noise, (payload,), lambda line: None)
    standard = fit_standard_model(*parts, noise, effects=(payload,))
    assert [one.effect.name for one in standard.effects] == ["torque_gain"]
    simulations = Simulations(search, search.base, noise_floor(recording))
    model, _ = hidden.added_to(search.start)
    fitted = fit(search.problem, model, search.unknowns(model), iterations=0)
    other = Explanation((hidden,), fitted, search.judged(model), 0.0, 0.9)
    monkeypatch.setattr(search.free_runs, "worse", lambda *compared: True)
    verdict = no_worse(Verdict("missing_effect", other), standard, search, simulations, search.free_runs)
    assert (verdict.kind, verdict.chosen.effects) == ("ambiguous", standard.effects)
    assert verdict.rivals == (other,)
