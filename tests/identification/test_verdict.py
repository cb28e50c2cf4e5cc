"""What the evidence says; costs of segments are made up."""

from dataclasses import replace

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.effects.effect import FINGER
from tactile_cube.identification.criteria import Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.search.candidates import Candidate, term_unknowns
from tactile_cube.identification.search.evidence import Judgement, gain, worse
from tactile_cube.identification.search.explanation import Explanation, at_bound, proven, sound, unproven
from tactile_cube.identification.search.findings import Findings
from tactile_cube.identification.verdict import decide, unexplained_joints
from tactile_cube.measurement.replay.model import Model, Term

MODEL = Model({}, (), {})
NOTHING = np.zeros((0, 0))
FIT = Fit(MODEL, (), 0.0, 0.0, NOTHING, NOTHING, NOTHING)


def judged(error: float, seed: int = 0) -> Judgement:
    """60 segments of 100 samples whose RMS error is about `error` times the noise."""
    scatter = np.random.default_rng(seed).uniform(0.8, 1.2, 60)
    costs = 100.0 * error**2 * scatter / scatter.mean()
    return Judgement(MODEL, costs, np.full(60, 100), NOTHING, np.array([error, 1.0]), np.arange(60) // 10)


def explanation(name: str, error: float, base: float = 20.0, seed: int = 0) -> Explanation:
    effect = find_effect(name)
    candidate = Candidate(effect, ("q1",), effect.forms_at(FINGER)[0])
    before, after = judged(base), judged(error, seed)
    return Explanation((candidate,), FIT, after, 1e-9, gain(before, after))


def at_its_edge(name: str) -> Fit:
    """A fit in which the first number of the last effect is as large as it may be."""
    effect = find_effect(name)
    first = effect.parameters[0]
    term = Term(effect, "q1", {p.name: p.high for p in effect.parameters}, (first.name,))
    return replace(FIT, model=Model({}, (term,), {}), unknowns=tuple(term_unknowns(term, 0, {})))


def findings(base: float, *level: Explanation) -> Findings:
    start = Explanation((), FIT, judged(base), 1.0, 0.0)
    return Findings(start, judged(2 * base), level)


def test_a_number_that_a_fit_chooses_where_a_trial_begins_counts_as_one() -> None:
    bias, integral = explanation("torque_bias", 1.02), explanation("integral_action", 1.02)
    clamped = replace(integral, effects=(replace(integral.effects[0], form={"ki": 5.0, "limit": 0.15}),))
    assert clamped.size == 3
    verdict = decide(findings(20.0, bias, clamped))
    assert (verdict.kind, verdict.chosen) == ("missing_effect", bias)


@pytest.mark.parametrize(("error", "known"), [(1.03, True), (1.1, False)])
def test_what_is_as_good_as_a_proven_set_is_its_rival_without_a_proof_of_its_own(error: float, known: bool) -> None:
    offset = explanation("position_offset", 1.02, 1.5)
    tilt = replace(explanation("mount_tilt", error, 1.5, 1), p_value=0.05)
    verdict = decide(findings(1.5, offset, tilt))
    assert verdict.chosen is offset
    assert (verdict.rivals == (tilt,)) is known


def test_where_nothing_is_named_the_model_that_predicts_best_is_recommended() -> None:
    plain = explanation("backlash", 10.2)
    best = replace(explanation("payload", 10.0), effects=(*plain.effects, *explanation("payload", 10.0).effects))
    verdict = decide(findings(20.0, plain, best))
    assert (verdict.kind, verdict.chosen) == ("unknown_effect", best)
    doubtful = replace(best, p_value=0.5)
    beside = findings(20.0, plain, doubtful)
    assert decide(beside).chosen == doubtful
    assert decide(findings(20.0, plain, replace(doubtful, fit=at_its_edge("payload")))).chosen == plain


def test_where_nothing_is_named_more_effects_are_recommended_only_beyond_a_standard_error() -> None:
    plain = explanation("backlash", 10.05, seed=1)
    both = (*plain.effects, *explanation("payload", 10.0).effects)
    best = replace(explanation("payload", 10.0, seed=2), effects=both)
    assert decide(findings(20.0, plain, best)).chosen == plain


def test_a_base_that_leaves_something_at_one_joint_is_not_adequate() -> None:
    found = findings(1.05)
    one_joint = replace(found.base.judgement, joint_errors=np.array([1.4, 1.0]))
    assert decide(found).kind == "adequate"
    assert decide(replace(found, base=replace(found.base, judgement=one_joint))).kind == "unknown_effect"


def test_a_law_that_contains_a_rival_is_no_rival_beside_it() -> None:
    chosen = explanation("torque_bias", 1.03)
    curve, constant = explanation("torque_curve", 1.03, seed=1), explanation("torque_gain", 1.031, seed=1)
    assert curve.size <= chosen.size + 1
    assert decide(findings(20.0, chosen, curve, constant)).rivals == (constant,)
    assert decide(findings(20.0, chosen, curve)).rivals == (curve,)


def test_a_richer_effect_that_does_no_better_is_no_rival() -> None:
    verdict = decide(findings(20.0, explanation("stribeck_friction", 1.03), explanation("coulomb_friction", 1.03)))
    assert verdict.kind == "missing_effect"
    assert verdict.chosen.effects[0].effect.name == "coulomb_friction"


def test_a_richer_effect_is_a_rival_only_if_it_does_noticeably_better() -> None:
    coulomb = explanation("coulomb_friction", 1.03)
    a_little = replace(
        explanation("stribeck_friction", 1.02), judgement=replace(judged(1.03), costs=judged(1.02).costs)
    )
    assert decide(findings(20.0, coulomb, a_little)).kind == "missing_effect"


def test_an_effect_with_a_number_more_is_a_rival_unless_it_contains_the_chosen_one() -> None:
    verdict = decide(findings(20.0, explanation("torque_gain", 1.0), explanation("payload", 1.0)))
    assert verdict.kind == "ambiguous"
    assert [one.effects[0].effect.name for one in verdict.rivals] == ["payload"]


def test_an_effect_that_explains_half_of_little_is_not_named() -> None:
    assert decide(findings(1.9, explanation("backlash", 1.5, 1.9))).kind == "unknown_effect"
    assert decide(findings(1.9, explanation("backlash", 1.1, 1.9))).kind == "missing_effect"


@pytest.mark.parametrize(("beside", "kind"), [(1.0, "partly_explained"), (1.4, "missing_effect")])
def test_a_set_beside_which_another_law_explains_most_of_the_rest_is_not_all(beside: float, kind: str) -> None:
    """Nearly everything is explained, and what is left shows in too few segments to prove the second law."""
    one = explanation("rate_limit", 1.8, 300.0)
    rest = np.zeros(60)
    rest[:4] = (one.judgement.costs.sum() - 6000.0 * beside**2) / 4
    less = replace(one, judgement=replace(one.judgement, costs=np.full(60, 100.0 * beside**2) + rest))
    both = (*one.effects, *explanation("actuator_lag", beside).effects)
    more = replace(explanation("rate_limit", beside, 300.0), effects=both)
    more = replace(more, judgement=replace(more.judgement, costs=np.full(60, 100.0 * beside**2)))
    verdict = decide(findings(300.0, less, more))
    assert (verdict.kind, verdict.chosen) == (kind, less)


def test_most_of_what_is_missing_is_named_and_said_not_to_be_all() -> None:
    lever, scale = explanation("payload", 5.0), explanation("torque_gain", 5.0)
    verdict = decide(findings(20.0, explanation("backlash", 5.0), explanation("elasticity", 9.0)))
    assert (verdict.kind, verdict.chosen.effects[0].effect.name, verdict.rivals) == ("partly_explained", "backlash", ())
    assert [one.effects[0].effect.name for one in decide(findings(20.0, lever, scale)).rivals] == ["payload"]
    assert decide(findings(20.0, explanation("backlash", 7.0))).kind == "unknown_effect"


def test_joints_are_unexplained_while_their_error_stays_above_the_noise() -> None:
    for error, joints in ((9.0, ["q1"]), (2.0, ["q1"]), (1.5, [])):
        assert unexplained_joints(explanation("backlash", error), ("q1", "q2")) == joints


@pytest.mark.parametrize(("factor", "found"), [(1.02, False), (1.06, True)])
def test_at_the_noise_a_steady_loss_above_the_price_speaks_against_an_effect(factor: float, found: bool) -> None:
    best = judged(1.0)
    assert worse(replace(best, costs=best.costs * factor), best) == found


def test_a_loss_is_measured_by_what_the_better_model_leaves_unexplained() -> None:
    best = judged(2.0)
    assert not worse(replace(best, costs=best.costs * 1.1), best)
    assert worse(replace(best, costs=best.costs * 1.5), best)


def test_a_single_segment_does_not_decide() -> None:
    best = judged(1.0)
    other = best.costs.copy()
    other[0] += 400.0
    assert not worse(replace(best, costs=other), best)


def with_waves(one: Explanation, sine: float) -> Explanation:
    values = {"sine": sine, "cosine": 0.0, "harmonic": 4.5}
    term = Term(find_effect("transmission_error"), "q1", values, tuple(values))
    return replace(one, fit=replace(FIT, model=Model({}, (term,), {}), unknowns=term_unknowns(term, 0)))


def test_an_effect_whose_number_ends_at_the_edge_of_the_plausible_stands_in_for_another() -> None:
    (edge,) = (p.high for p in find_effect("transmission_error").parameters if p.name == "sine")
    one = explanation("transmission_error", 1.2)
    assert decide(findings(20.0, with_waves(one, 0.9 * edge))).kind == "missing_effect"
    assert decide(findings(20.0, with_waves(one, edge))).kind == "unknown_effect"
    other = explanation("load_dependent_friction", 1.2)
    verdict = decide(findings(20.0, with_waves(one, edge), other))
    assert (verdict.kind, verdict.chosen, verdict.rivals) == ("missing_effect", other, ())


def test_a_criterion_that_is_given_decides() -> None:
    found = findings(9.0, explanation("backlash", 1.9, 9.0))
    assert decide(found).kind == "partly_explained"
    assert decide(found, criteria=Criteria(tolerated=2.0)).kind == "missing_effect"


def test_a_drift_as_slow_as_can_be_told_is_no_implausible_law() -> None:
    """Its longest time constant stands for all longer ones: friction that changes in proportion to the time."""
    drift = explanation("friction_drift", 1.0)
    slow = Term(drift.effects[0].effect, "q1", {"change": -0.7, "time_constant": 200.0, "friction": 0.0}, ())
    for fitted, edge in ((("time_constant",), False), (("change",), True)):
        values = slow.values | ({"change": -5.0} if edge else {})
        term = replace(slow, values=values, fitted=fitted)
        fit = replace(FIT, model=Model({}, (term,), {}), unknowns=tuple(term_unknowns(term, 0, {})))
        assert at_bound(replace(drift, fit=fit)) is edge


@pytest.mark.parametrize(
    ("left", "kind"), [(1.1, "missing_effect"), (2.0, "partly_explained"), (4.0, "unknown_effect")]
)
def test_a_set_that_leaves_more_than_is_tolerated_is_the_whole_only_if_it_explains_nearly_all(left, kind) -> None:
    assert decide(findings(9.0, explanation("backlash", left, 9.0))).kind == kind
    assert decide(findings(90.0, explanation("backlash", left, 90.0))).kind == "missing_effect"


def test_an_effect_is_proven_by_its_size_and_its_certainty_and_unproven_if_only_large() -> None:
    found = replace(explanation("backlash", 9.0), gain=0.5, p_value=0.002)
    assert proven(found)
    assert not proven(replace(found, gain=0.03)), "too little to speak of"
    assert not proven(replace(found, p_value=0.02)), "may be chance"
    assert [unproven(replace(found, p_value=0.02, gain=gain)) for gain in (0.5, 0.2)] == [True, False]


def test_a_set_is_refused_to_which_another_adds_what_is_proven() -> None:
    less, more = explanation("torque_saturation", 10.0), explanation("torque_saturation", 9.0)
    other = explanation("command_delay", 10.0)
    more = replace(more, effects=(*more.effects, *explanation("torque_gain", 9.0).effects))
    base = findings(20.0).base
    assert sound([less, more, other], base) == [more, other], "what it adds to is refused, another law is not"
    useless = replace(more, judgement=judged(10.5))
    assert sound([less, useless, other], base) == [less, other], "as is a set that does no better without one effect"


@pytest.mark.parametrize(("left", "named"), [(4.0, 1), (2.0, 2)])
def test_what_comes_to_a_set_that_is_complete_has_to_take_away_most_of_the_rest(left: float, named: int) -> None:
    """Of what a law in another form leaves many others take a part."""
    alone, more = explanation("torque_saturation", 9.0, 90.0), explanation("torque_saturation", left, 90.0)
    both = replace(more, effects=(*more.effects, *explanation("torque_gain", left).effects))
    verdict = decide(findings(90.0, alone, both))
    assert len(verdict.chosen.effects) == named
    assert verdict.kind == ("partly_explained" if named == 1 else "missing_effect")


def test_where_a_chain_of_sets_refutes_all_of_them_the_best_one_stands() -> None:
    """Two laws take 0.83 of the rest of one, three 0.83 of theirs, but three take most of what one leaves."""
    one, two, three = (explanation("backlash", np.sqrt(1.0 + rest), 90.0) for rest in (90.0, 15.0, 2.5))
    more, most = explanation("torque_gain", 2.0).effects, explanation("torque_bias", 2.0).effects
    two, three = (replace(e, effects=(*e.effects, *added)) for e, added in ((two, more), (three, (*more, *most))))
    assert sound([one, two, three], findings(90.0).base) == [three]
