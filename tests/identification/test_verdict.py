"""What the evidence says: costs of segments are made up; what a decision asks is simulated, once each."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification import verdict as asked
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.search.candidates import Candidate, forms, term_unknowns
from tactile_cube.identification.search.evidence import Judgement, gain, worse
from tactile_cube.identification.search.explanation import (
    Explanation,
    least_gain,
    needless,
    unproven,
    worthwhile,
)
from tactile_cube.identification.search.findings import Findings
from tactile_cube.identification.verdict import Simulations, Unexplained, Verdict, at_bound, unexplained_joints
from tactile_cube.measurement.replay.model import Model, Term

MODEL = Model({}, (), {})
NOTHING = np.zeros((0, 0))
FIT = Fit(MODEL, (), 0.0, 0.0, NOTHING, NOTHING, NOTHING)


def judged(error: float, seed: int = 0) -> Judgement:
    """60 segments of 100 samples whose RMS error is about `error` times the noise."""
    scatter = np.random.default_rng(seed).uniform(0.8, 1.2, 60)
    costs = 100.0 * error**2 * scatter / scatter.mean()
    return Judgement(MODEL, costs, np.full(60, 100), NOTHING, np.array([error, 1.0]), np.arange(60) // 10)


JOINTS = ("q1", "q2")


class Answers:
    """What simulations would say, made up."""

    def __init__(
        self, repeats: bool = False, follows: bool = False, alike: bool = False, elsewhere: bool = False
    ) -> None:
        self.repeats, self.follows, self.same, self.elsewhere = repeats, follows, alike, elsewhere

    def leaves_elsewhere(self, one: Explanation) -> bool:
        return self.elsewhere

    def as_repeats(self, one: Explanation) -> bool:
        return self.repeats

    def follows_signals(self, one: Explanation) -> bool:
        return self.follows

    def alike(self, one: Explanation, other: Explanation) -> bool:
        return self.same


def decide(found: Findings, answers: Answers | None = None, criteria: Criteria = STANDARD) -> Verdict:
    """The verdict where simulations would say so."""
    return asked.decide(found, answers or Answers(), criteria)  # type: ignore[arg-type]


def explanation(name: str, error: float, base: float = 20.0, seed: int = 0) -> Explanation:
    effect = find_effect(name)
    candidate = Candidate(effect, ("q1",), forms(effect)[0])
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
    return Findings(start, judged(2 * base), (level,) if level else (), ())


def test_a_base_model_at_the_noise_is_adequate() -> None:
    assert decide(findings(1.02)).kind == "adequate"


def test_a_number_that_a_fit_chooses_where_a_trial_begins_counts_as_one() -> None:
    bias, integral = explanation("torque_bias", 1.02), explanation("integral_action", 1.02)
    clamped = replace(integral, effects=(replace(integral.effects[0], form={"ki": 5.0, "limit": 0.15}),))
    assert clamped.size == 3
    verdict = decide(findings(20.0, bias, clamped))
    assert (verdict.kind, verdict.chosen) == ("missing_effect", bias)


def test_where_nothing_is_named_the_model_that_predicts_best_is_recommended() -> None:
    plain = explanation("backlash", 10.2)
    best = replace(explanation("payload", 10.0), effects=(*plain.effects, *explanation("payload", 10.0).effects))
    verdict = decide(findings(20.0, plain, best))
    assert (verdict.kind, verdict.chosen) == ("unknown_effect", best)
    beside = replace(findings(20.0, plain), unclear=(best,))
    assert decide(beside) == verdict
    assert decide(replace(beside, unclear=(replace(best, fit=at_its_edge("payload")),))).chosen == plain


def test_an_error_that_no_effect_lowers_is_unknown() -> None:
    assert decide(findings(8.0)).kind == "unknown_effect"


def test_the_only_effect_that_reaches_the_noise_is_the_missing_one() -> None:
    verdict = decide(findings(20.0, explanation("command_delay", 1.03), explanation("actuator_lag", 6.0)))
    assert verdict.kind == "missing_effect"
    assert verdict.chosen.effects[0].effect.name == "command_delay"


def test_a_base_that_leaves_something_at_one_joint_is_not_adequate() -> None:
    found = findings(1.05)
    one_joint = replace(found.base.judgement, joint_errors=np.array([1.4, 1.0]))
    assert decide(found).kind == "adequate"
    assert decide(replace(found, base=replace(found.base, judgement=one_joint))).kind == "unknown_effect"


def test_two_effects_that_do_equally_well_are_ambiguous() -> None:
    verdict = decide(findings(20.0, explanation("torque_bias", 1.03), explanation("torque_gain", 1.031, seed=1)))
    assert verdict.kind == "ambiguous"
    assert [one.effects[0].effect.name for one in verdict.rivals] == ["torque_gain"]


def test_a_part_is_named_where_the_rest_is_followed_by_an_implausible_law() -> None:
    stop, curve = explanation("joint_stop", 4.5), explanation("position_torque", 1.5)
    both = replace(curve, effects=(*stop.effects, *curve.effects), fit=at_its_edge("position_torque"))
    verdict = decide(findings(20.0, stop, both))
    assert (verdict.kind, verdict.chosen) == ("partly_explained", stop)
    poor = replace(stop, judgement=judged(9.0))
    assert decide(findings(20.0, poor, both)).kind == "unknown_effect"
    assert decide(findings(20.0, replace(both, effects=curve.effects))).kind == "unknown_effect"


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


def test_more_numbers_that_follow_a_detail_of_something_else_do_not_win() -> None:
    coulomb = explanation("coulomb_friction", 1.003)  # significantly worse over six thousand samples, and yet the whole
    verdict = decide(findings(20.0, explanation("stribeck_friction", 0.997), coulomb))
    assert (verdict.kind, verdict.chosen.effects[0].effect.name) == ("missing_effect", "coulomb_friction")


def test_another_effect_is_no_detail_however_little_it_explains() -> None:
    verdict = decide(findings(20.0, explanation("payload", 0.997), explanation("torque_gain", 1.003)))
    assert verdict.chosen.effects[0].effect.name == "payload"


def test_an_effect_with_a_number_more_is_a_rival_unless_it_contains_the_chosen_one() -> None:
    verdict = decide(findings(20.0, explanation("torque_gain", 1.0), explanation("payload", 1.0)))
    assert verdict.kind == "ambiguous"
    assert [one.effects[0].effect.name for one in verdict.rivals] == ["payload"]


def test_more_numbers_that_explain_a_real_part_win() -> None:
    coulomb = explanation("coulomb_friction", 1.4)
    verdict = decide(findings(20.0, explanation("stribeck_friction", 1.0), coulomb))
    assert (verdict.kind, verdict.chosen.effects[0].effect.name) == ("missing_effect", "stribeck_friction")


def test_an_effect_that_leaves_much_unexplained_is_not_named() -> None:
    assert decide(findings(20.0, explanation("backlash", 9.0))).kind == "unknown_effect"


def test_an_effect_that_explains_half_of_little_is_not_named() -> None:
    assert decide(findings(1.9, explanation("backlash", 1.5, 1.9))).kind == "unknown_effect"
    assert decide(findings(1.9, explanation("backlash", 1.1, 1.9))).kind == "missing_effect"


@pytest.mark.parametrize(
    ("left", "kind"), [(1.5, "missing_effect"), (2.0, "partly_explained"), (3.3, "unknown_effect")]
)
def test_an_effect_that_leaves_twice_the_noise_is_the_whole_only_if_it_explains_nearly_all(
    left: float, kind: str
) -> None:
    assert decide(findings(9.0, explanation("backlash", left, 9.0))).kind == kind
    assert decide(findings(90.0, explanation("backlash", left, 90.0))).kind == "missing_effect"


def test_what_an_effect_leaves_at_other_joints_is_no_detail_of_its_law() -> None:
    found = findings(90.0, explanation("backlash", 2.0, 90.0))
    assert decide(found, Answers(elsewhere=True)).kind == "partly_explained"


def test_of_two_effects_that_leave_twice_the_noise_one_may_follow_a_detail_of_the_other() -> None:
    one = explanation("torque_saturation", 4.5, 90.0)
    for left, kind in ((1.5, "missing_effect"), (3.3, "partly_explained")):
        both = explanation("torque_gain", left, 90.0)
        both = replace(both, effects=(*one.effects, *both.effects))
        assert decide(findings(90.0, one, both)).kind == kind
        assert decide(findings(90.0, one, both), Answers(repeats=True)).kind == "missing_effect"


def test_an_effect_that_leaves_no_more_than_repeats_differ_is_named_if_it_explains_nearly_all() -> None:
    tipping = findings(100.0, explanation("torque_saturation", 4.5, 100.0))
    assert decide(tipping).kind == "partly_explained"
    assert decide(tipping, Answers(repeats=True)).kind == "missing_effect"
    assert decide(findings(20.0, explanation("backlash", 9.0)), Answers(repeats=True)).kind == "partly_explained"


def test_most_of_what_is_missing_is_named_and_said_not_to_be_all() -> None:
    lever, scale = explanation("payload", 5.0), explanation("torque_gain", 5.0)
    verdict = decide(findings(20.0, explanation("backlash", 5.0), explanation("elasticity", 9.0)))
    assert (verdict.kind, verdict.chosen.effects[0].effect.name, verdict.rivals) == ("partly_explained", "backlash", ())
    assert [one.effects[0].effect.name for one in decide(findings(20.0, lever, scale)).rivals] == ["payload"]
    assert decide(findings(20.0, explanation("backlash", 7.0))).kind == "unknown_effect"


def test_joints_are_unexplained_while_their_error_stays_above_the_noise() -> None:
    for error, joints in ((9.0, ["q1"]), (2.0, ["q1"]), (1.5, [])):
        assert unexplained_joints(explanation("backlash", error), ("q1", "q2")) == joints


def test_a_further_effect_needs_a_real_part_of_the_error() -> None:
    base = Explanation((), FIT, judged(20.0), 1.0, 0.0)
    first = explanation("command_delay", 2.0)
    tiny = replace(explanation("torque_bias", 1.9), gain=0.1)
    completing = replace(explanation("torque_bias", 1.05), gain=0.7)
    assert not worthwhile(tiny, first, base, JOINTS)
    assert worthwhile(completing, first, base, JOINTS)


def test_what_is_next_to_nothing_beside_the_whole_is_a_detail_of_the_first_effect() -> None:
    first, second = explanation("friction_drift", 1.11), replace(explanation("viscous_friction", 1.0), gain=0.18)
    for base, real in ((9.0, False), (5.0, True)):
        start = Explanation((), FIT, judged(base), 1.0, 0.0)
        assert worthwhile(second, first, start, JOINTS) is real


def test_a_large_share_needs_less_significance_than_a_small_one() -> None:
    base = Explanation((), FIT, judged(2.4), 1.0, 0.0)
    found = replace(explanation("backlash", 1.4, 2.4), p_value=6e-4)
    assert worthwhile(replace(found, gain=0.6), base, base, JOINTS)
    assert not worthwhile(replace(found, gain=0.1), base, base, JOINTS)
    assert not worthwhile(replace(found, gain=0.6, p_value=0.01), base, base, JOINTS)


def test_a_second_effect_that_a_large_remainder_needs_is_no_detail_of_the_first() -> None:
    base = Explanation((), FIT, judged(300.0), 1.0, 0.0)
    stop, small = explanation("joint_stop", 14.0), explanation("joint_stop", 3.5)
    assert worthwhile(replace(explanation("stribeck_friction", 2.5), gain=0.97), stop, base, JOINTS)
    assert not worthwhile(replace(explanation("stribeck_friction", 8.0), gain=0.7), stop, base, JOINTS)
    assert not worthwhile(replace(explanation("stribeck_friction", 1.4), gain=0.84), small, base, JOINTS)
    nearly_all = replace(explanation("stribeck_friction", 1.2), gain=0.84)
    middling = explanation("joint_stop", 3.0)
    assert worthwhile(nearly_all, middling, base, JOINTS)
    assert not worthwhile(nearly_all, explanation("joint_stop", 1.9), base, JOINTS), "a detail of the first"


@pytest.mark.parametrize(("own", "enough"), [(1.02, True), (1.4, False)])
def test_a_second_effect_may_complete_its_own_joint_while_another_stays_rough(own: float, enough: bool) -> None:
    base = Explanation((), FIT, judged(300.0), 1.0, 0.0)
    stop = replace(explanation("joint_stop", 1.9), judgement=replace(judged(1.9), joint_errors=np.array([1.7, 2.2])))
    after = replace(judged(1.4), joint_errors=np.array([1.7, own]))
    gear = replace(explanation("torque_gain", 1.4), judgement=after, gain=0.5)
    gear = replace(gear, effects=(replace(gear.effects[0], joints=("q2",)),))
    assert worthwhile(gear, stop, base, JOINTS) is enough


@pytest.mark.parametrize(("factor", "found"), [(1.001, False), (1.02, True)])
def test_at_the_noise_a_small_but_steady_loss_speaks_against_an_effect(factor: float, found: bool) -> None:
    best = judged(1.0)
    assert worse(replace(best, costs=best.costs * factor), best) == found


def test_a_loss_is_measured_by_what_the_better_model_leaves_unexplained() -> None:
    best = judged(2.0)
    assert not worse(replace(best, costs=best.costs * 1.1), best)
    assert worse(replace(best, costs=best.costs * 1.5), best)


def test_a_law_of_one_joint_is_judged_by_what_is_left_there() -> None:
    best, parts = judged(2.0), judged(1.2).costs / 2.0
    best = replace(best, joint_costs=np.stack([best.costs - parts, parts], axis=1))
    more = replace(best, costs=best.costs + parts, joint_costs=np.stack([best.costs - parts, 2.0 * parts], axis=1))
    assert not worse(more, best)
    (here,) = explanation("backlash", 2.0).effects
    there = replace(here, joints=("q2",))
    assert [needless(best, more, JOINTS, removed) for removed in ([here], [there])] == [True, False]


def test_a_single_segment_does_not_decide() -> None:
    best = judged(1.0)
    other = best.costs.copy()
    other[0] += 400.0
    assert not worse(replace(best, costs=other), best)


def test_a_rival_that_the_held_out_trials_speak_against_is_none() -> None:
    verdict = decide(findings(20.0, explanation("torque_bias", 1.0), explanation("torque_gain", 1.05)))
    assert verdict.kind == "missing_effect"


def test_one_effect_that_does_as_well_beats_two() -> None:
    one = explanation("stribeck_friction", 1.03)
    both = replace(one, effects=(*one.effects, *explanation("torque_bias", 1.0).effects))
    found = Findings(findings(20.0).base, judged(40.0), ((both,), (one,)), ())
    assert decide(found).chosen is one


def test_next_to_nothing_of_the_whole_is_no_second_effect() -> None:
    for before, found, second in ((22.0, 1.14, 1.09), (3.0, 1.25, 1.05)):
        base = Explanation((), FIT, judged(before), 1.0, 0.0)
        parent = explanation("load_dependent_friction", found, before)
        delay = explanation("command_delay", second, found)
        both = replace(delay, effects=(*parent.effects, *delay.effects))
        assert worthwhile(both, parent, base, JOINTS) is (before < 10)


def test_one_effect_that_explains_everything_needs_less_significance() -> None:
    base = Explanation((), FIT, judged(1.15), 1.0, 0.0)
    whole, part = explanation("elasticity", 1.02, 1.15), explanation("elasticity", 1.12, 1.15)
    assert worthwhile(replace(whole, p_value=6e-3, gain=0.2), base, base, JOINTS)
    assert not worthwhile(replace(part, p_value=6e-3, gain=0.05), base, base, JOINTS)
    assert not worthwhile(replace(whole, p_value=6e-3, gain=0.2), part, base, JOINTS)


def test_a_further_effect_has_to_finish_what_is_nearly_explained() -> None:
    base = Explanation((), FIT, judged(20.0), 1.0, 0.0)
    nearly, far, partly = (explanation("cogging", error) for error in (1.5, 8.0, 3.5))
    assert least_gain(base, base) == STANDARD.least_gain
    # the one joint with error 1.5 down to 1.1, where the other one has 1.0
    assert least_gain(nearly, base) == pytest.approx((1.5**2 - 1.1**2) / (1.5**2 + 1.0))
    assert least_gain(far, base) == STANDARD.least_gain, "most of what is left may be anything"
    assert least_gain(partly, replace(base, judgement=judged(6.0))) == STANDARD.least_gain, "much is not explained yet"


def test_much_that_few_segments_do_not_tell_from_chance_is_unproven_not_unknown() -> None:
    base = findings(20.0).base
    found = replace(explanation("backlash", 9.0), gain=0.5, p_value=0.02)
    few = replace(found.judgement, samples=np.where(np.arange(60) < STANDARD.few_segments - 1, 100, 0))
    assert unproven(replace(found, judgement=few), base)
    assert not unproven(found, base), "with so many segments chance is no excuse"
    assert not unproven(replace(found, judgement=few, p_value=1e-5), base), "proven"
    assert not unproven(replace(found, judgement=few, gain=0.1), base), "too little to speak of"
    assert not unproven(replace(found, judgement=few, gain=0.9, p_value=0.005), base), "so much needs hardly any proof"


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


def test_what_is_left_and_follows_the_signals_is_decided_in_the_same_place() -> None:
    found = findings(20.0, explanation("backlash", 1.2))
    assert decide(found).kind == "missing_effect"
    assert decide(found, Answers(follows=True)).kind == "partly_explained"


@pytest.mark.parametrize("best", ["presliding_friction", "coulomb_friction"])
def test_a_law_that_is_the_simpler_one_in_practice_is_no_rival_of_it(best: str) -> None:
    errors = {"presliding_friction": 1.0, "coulomb_friction": 1.0} | {best: 0.9995}
    found = findings(20.0, *(explanation(name, error) for name, error in errors.items()))
    verdict = decide(found, Answers(alike=True))
    assert verdict.kind == "missing_effect"
    assert verdict.chosen.effects[0].effect.name == "coulomb_friction"
    twins = findings(20.0, explanation("torque_gain", 1.0), explanation("payload", 1.0))
    assert decide(twins, Answers(alike=True)).kind == "ambiguous", "different laws stay rivals however alike"


@pytest.mark.parametrize("alike", [True, False])
def test_of_rivals_that_are_one_law_in_practice_the_simpler_one_is_named(alike: bool) -> None:
    found = findings(20.0, *(explanation(name, 1.0) for name in ("elasticity", "torque_gain", "torque_curve")))
    verdict = decide(found, Answers(alike=alike))
    named = {one.effects[0].effect.name for one in (verdict.chosen, *verdict.rivals)}
    assert named == {"elasticity", "torque_gain"} | (set() if alike else {"torque_curve"})


def test_another_law_that_predicts_the_same_is_a_rival_though_the_data_speak_against_it() -> None:
    found = findings(20.0, explanation("torque_gain", 1.0), explanation("elasticity", 1.05))
    assert decide(found).kind == "missing_effect", "the difference is significant"
    verdict = decide(found, Answers(alike=True))
    assert verdict.kind == "ambiguous"
    assert [one.effects[0].effect.name for one in verdict.rivals] == ["elasticity"]
    richer = findings(20.0, explanation("torque_gain", 1.0), explanation("stribeck_friction", 1.05))
    assert decide(richer, Answers(alike=True)).kind == "missing_effect", "more numbers follow more"
    far = findings(20.0, explanation("torque_gain", 1.0), explanation("elasticity", 1.15))
    assert decide(far, Answers(alike=True)).kind == "missing_effect", "errors so different are never alike"


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


class Judges:
    """Held-out trials on which a second model is off by so many standard deviations of the noise."""

    weight = np.full((3, 5), 1e4)

    def __init__(self, off: float) -> None:
        self.off = off

    def predictions(self, models: list[object]) -> np.ndarray:
        return np.stack([np.zeros((3, 5)), np.full((3, 5), self.off / 1e4)])

    def limited(self, change: np.ndarray) -> np.ndarray:
        return change


def simulations(monkeypatch: pytest.MonkeyPatch, source: str = "repeats", off: float = 0.0) -> Simulations:
    monkeypatch.setattr(asked, "Problem", lambda *_: None)
    search = SimpleNamespace(shooting=None, all_windows=None, criteria=STANDARD, validation=Judges(off), held_out=None)
    floor = SimpleNamespace(source=source, joints={"q1": 2e-3, "q2": 1.0})
    return Simulations(search, explanation("backlash", 9.0), floor, "fast", 0.002)  # type: ignore[arg-type]


@pytest.mark.parametrize(("off", "alike"), [(0.0, True), (0.09, True), (0.3, False)])
def test_laws_that_differ_by_a_part_of_the_noise_are_one(
    monkeypatch: pytest.MonkeyPatch, off: float, alike: bool
) -> None:
    ask = simulations(monkeypatch, off=off)
    assert ask.alike(explanation("coulomb_friction", 1.0), explanation("presliding_friction", 1.0)) is alike


@pytest.mark.parametrize(
    ("source", "left", "answer"), [("repeats", 1e-3, True), ("repeats", 3e-3, False), ("guess", 1e-3, False)]
)
def test_a_free_run_is_compared_with_repeats_once(
    monkeypatch: pytest.MonkeyPatch, source: str, left: float, answer: bool
) -> None:
    ask, runs = simulations(monkeypatch, source), []

    def error(held_out: object, simulated: object) -> object:
        runs.append(simulated)
        return SimpleNamespace(joints={"q1": left, "q2": 0.0})  # q2 hardly repeats itself

    monkeypatch.setattr(ask, "final", lambda one: SimpleNamespace(model=one.judgement.model))
    monkeypatch.setattr(asked, "free_run", lambda *_: "run")
    monkeypatch.setattr(asked, "free_run_error", error)
    one = explanation("coulomb_friction", 1.0)
    assert ask.as_repeats(one) is ask.as_repeats(one) is answer
    assert runs == (["run"] if source == "repeats" else [])


@pytest.mark.parametrize(("left", "answer"), [((), False), ((0.1, 0.0), False), ((0.0, 0.45), True)])
def test_what_is_left_follows_the_signals_where_a_black_box_explains_more_than_chance(
    monkeypatch: pytest.MonkeyPatch, left: tuple[float, ...], answer: bool
) -> None:
    ask = simulations(monkeypatch)
    monkeypatch.setattr(ask, "unexplained", lambda one: [Unexplained("q1", [], share) for share in left])
    assert ask.follows_signals(explanation("backlash", 2.0)) is answer


@pytest.mark.parametrize(
    ("name", "joint_errors", "elsewhere"),
    [("backlash", (2.0, 1.0), False), ("backlash", (1.0, 2.0), True), ("payload", (1.0, 2.0), False)],
)
def test_an_effect_of_a_joint_leaves_something_elsewhere_and_one_of_the_mechanism_nowhere(
    monkeypatch: pytest.MonkeyPatch, name: str, joint_errors: tuple[float, float], elsewhere: bool
) -> None:
    ask, one = simulations(monkeypatch), explanation(name, 2.0)
    ask.search.fitted = SimpleNamespace(joints=JOINTS)  # type: ignore[assignment]
    one = replace(one, judgement=replace(one.judgement, joint_errors=np.array(joint_errors)))
    assert ask.leaves_elsewhere(one) is elsewhere
