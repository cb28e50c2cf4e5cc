"""What may be missing, in which forms and from which starts; simpler and richer laws; values around a fit."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import catalogue, find_effect
from tactile_cube.drivetrain.effects.scales import FINGER, Scales
from tactile_cube.identification.search import search as module
from tactile_cube.identification.search.candidates import (
    Candidate,
    candidates,
    forms,
    other_starts,
    special_cases,
    with_details,
)
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.screening import Score, resized, start
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model
from tests.identification.test_verdict import FIT, judged
from tests.measurement.small_rig import write

SCORE = Score(Candidate(find_effect("command_delay"), ("q1",), {"delay": 0.005}), 1.0, 3.0)


def sizes(recording: Recording) -> dict[str, Scales]:
    return dict(zip(recording.joints, joint_scales(recording), strict=True))


def test_several_numbers_start_with_either_sign() -> None:
    starts = find_effect("asymmetric_friction").starts_at(FINGER)
    assert {"difference": 0.02, "friction": 0.02} in starts
    assert {"difference": -0.02, "friction": 0.02} in starts


def test_a_single_number_and_a_place_have_no_other_sign() -> None:
    assert find_effect("torque_bias").starts_at(FINGER) == [{"bias": 0.005}]
    assert len(find_effect("joint_stop").starts_at(FINGER)) == 6


@pytest.mark.parametrize(
    ("second", "taken"),
    [((0.96, 0.5), 1), ((0.90, 0.5), 0), ((0.96, 7.0), 0), ((0.96, -1.0), 0)],
    ids=["nearer its size", "clearly less", "further from it", "of the other sign"],
)
def test_of_starts_that_look_as_good_the_one_nearest_its_size_is_refitted(
    second: tuple[float, float], taken: int
) -> None:
    scores = [replace(SCORE, gain=1.0, factor=6.0), replace(SCORE, gain=second[0], factor=second[1])]
    assert start(scores) is scores[taken]


def test_a_single_number_starts_as_large_as_the_first_look_says() -> None:
    assert resized(SCORE).form["delay"] == pytest.approx(0.015)


@pytest.mark.parametrize(
    "score",
    [
        replace(SCORE, factor=50.0),
        replace(SCORE, candidate=Candidate(find_effect("torque_saturation"), ("q1",), {"limit": 0.1})),
    ],
    ids=["not believed", "a limit is no size"],
)
def test_other_starts_stay(score: Score) -> None:
    assert resized(score) is score.candidate


def test_a_stiffening_drive_starts_where_its_bend_can_be_seen(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    found = [c for c in candidates(sizes(recording), [find_effect("stiffening_elasticity")]) if c.joints == ("a",)]
    torque = [3.0 * (t.command - t.position) - 0.2 * t.velocity() for t in recording.trials]
    usual = float(np.quantile(np.abs(np.concatenate(torque)[:, 0]), 0.9))
    bends = [c.form["cubic"] * (c.form["compliance"] * usual) ** 3 / usual for c in found]
    # beyond, at and below the usual torques, from a soft and a stiff start
    expected = [1.0, 1.0, 100.0, 100.0, 1e4, 1e4]
    assert sorted(bends) == pytest.approx(expected, rel=0.01)


def test_where_torques_are_commanded_a_saturation_starts_among_them(tmp_path: Path) -> None:
    def commanded(data: dict[str, Any]) -> None:
        data["controller"] = {"mode": "torque"}

    recording = read_recording(write(tmp_path, commanded))
    found = candidates(sizes(recording), [find_effect("torque_saturation")])
    largest = max(np.abs(t.command[:, 0]).max() for t in recording.trials)
    starts = [c.form["limit"] for c in found if c.joints == ("a",)]
    assert len(starts) == 9
    assert all(0.2 * largest < start <= largest for start in starts)
    np.testing.assert_allclose(np.diff(np.log(starts)), np.log(starts[1] / starts[0]))  # no wide gap between any two


KNOWN = candidates({"q2": FINGER}, list(catalogue().values()))


def fitted(*names: str, joints: tuple[str, ...] = ("q2",)) -> tuple[list[Candidate], Model]:
    """Effects in their first forms, and a model that has them."""
    effects, model = [], Model({}, (), {})
    for name in names:
        effects.append(Candidate(find_effect(name), joints, forms(find_effect(name))[0]))
        model = effects[-1].added_to(model)[0]
    return effects, model


def waving(model: Model, harmonic: float) -> Model:
    """The model with its last effect, a ripple, at a harmonic."""
    *others, ripple = model.terms
    return replace(model, terms=(*others, replace(ripple, values={**ripple.values, "harmonic": harmonic})))


def test_the_details_of_a_law_are_freed_from_where_its_plain_form_is() -> None:
    (drift,), model = fitted("friction_drift", joints=("q1", "q2"))
    warm = replace(model.terms[1], values={**model.terms[1].values, "change": -0.013})
    found = with_details(drift, replace(model, terms=(model.terms[0], warm)))
    assert found is not None
    candidate, detailed, unknowns = found
    assert tuple(candidate.form) == ("change", "time_constant", "friction")
    assert [(u.place, u.key) for u in unknowns] == [(k, name) for k in (0, 1) for name in candidate.form]
    assert detailed.terms[1].values == warm.values, "where the plain form is, with the details at no effect"
    assert detailed.terms[1].values["friction"] == 0.0
    assert with_details(candidate, detailed) is None, "all are free already"


@pytest.mark.parametrize(("harmonic", "told"), [(6.0, False), (10.0, True)])
def test_overtones_are_told_where_a_ripple_is_seen_to_repeat(harmonic: float, told: bool) -> None:
    """A finger's 1.2 rad are 1.1 and 1.9 periods; three waves follow any torque over a single one."""
    (ripple,), model = fitted("cogging")
    assert (with_details(ripple, waving(model, harmonic)) is not None) == told


def test_only_the_last_effect_gets_details_and_a_law_without_any_gets_none() -> None:
    (_, ripple), model = fitted("torque_gain", "cogging")
    found = with_details(ripple, waving(model, 12.0))
    assert found is not None
    assert found[1].terms[0] == model.terms[0]
    assert found[0].size == 7
    assert {u.place for u in found[2]} == {1}
    (gain,), model = fitted("torque_gain")
    assert with_details(gain, model) is None


def test_a_special_case_takes_the_place_of_the_richer_law() -> None:
    effects, model = fitted("torque_curve", "command_dead_zone")
    ((simple, changed),) = special_cases(model, effects, 0, KNOWN)
    assert [one.effect.name for one in simple] == ["torque_gain", "command_dead_zone"]
    assert [term.effect.name for term in changed.terms] == ["torque_gain", "command_dead_zone"]
    assert changed.terms[1] == model.terms[1]
    assert list(special_cases(model, effects, 1, KNOWN)) == [], "a dead zone contains nothing simpler"


def test_a_special_case_has_fewer_numbers() -> None:
    effects, model = fitted("stiffening_elasticity", "coulomb_friction")
    starts = {sets[0].effect.name for sets, _ in special_cases(model, effects, 0, KNOWN)}
    assert starts == {"elasticity"}, "from a soft and a stiff start"
    effects, model = fitted("backlash", "coulomb_friction")
    assert list(special_cases(model, effects, 0, KNOWN)) == [], "elasticity has as many as a play"


def test_a_law_with_a_number_less_is_a_special_case_of_itself() -> None:
    viscous = find_effect("viscous_friction")
    by_direction = Candidate(viscous, ("q2",), {"damping": 0.01, "difference": 0.002})
    model = by_direction.added_to(Model({}, (), {}))[0]
    ((simpler,), _), *others = special_cases(model, [by_direction], 0, KNOWN)
    assert not others
    assert (simpler.effect, tuple(simpler.form)) == (viscous, ("damping",))


class Stubbed(Search):
    """A search whose fits end at given costs and whose models do as well on the held-out trials as is said."""

    def __init__(self, errors: dict[str, float]) -> None:
        self.errors, self.candidates, self.problem = errors, KNOWN, None  # type: ignore[assignment]
        self.start, self.effects = Model({}, (), {}), tuple(catalogue().values())
        self.fitted = SimpleNamespace(joints=("q1", "q2", "q3"))  # type: ignore[assignment]
        self.said: list[str] = []
        self.say = self.said.append

    def settled(self, model: Model) -> tuple[object, object]:  # type: ignore[override]
        names, joints = "+".join(t.effect.name for t in model.terms), "+".join(t.joint for t in model.terms)
        return replace(FIT, model=model), judged(self.errors.get(names, self.errors.get(joints, 9.0)))


@pytest.mark.parametrize(("error", "kept"), [(1.0, "torque_gain"), (1.6, "torque_curve")])
def test_of_two_laws_in_a_set_the_simpler_is_kept_if_it_does(error: float, kept: str) -> None:
    effects, model = fitted("torque_curve", "command_dead_zone")
    found = Explanation(tuple(effects), replace(FIT, model=model), judged(1.0), 1e-9, 0.5)
    pruned = Stubbed({"torque_gain+command_dead_zone": error}).pruned(found)
    assert [one.effect.name for one in pruned.effects] == [kept, "command_dead_zone"]
    assert [term.effect.name for term in pruned.fit.model.terms] == [kept, "command_dead_zone"]


def test_a_wave_takes_the_place_of_a_profile_that_is_one() -> None:
    place = np.linspace(-0.2, 1.2, 17)
    profile = Candidate(
        find_effect("position_torque"),
        ("q2",),
        {f"torque_{k}": float(one) for k, one in enumerate(0.03 * np.sin(9.0 * place))},
    )
    (dead,), model = fitted("command_dead_zone")
    model = profile.added_to(model)[0]
    model = replace(
        model,
        terms=(replace(model.terms[1], values={**model.terms[1].values, "first": -0.2, "last": 1.2}), model.terms[0]),
    )
    found = Explanation((profile, dead), replace(FIT, model=model), judged(1.0), 1e-9, 0.5)
    pruned = Stubbed({"cogging+command_dead_zone": 1.0}).pruned(found)
    assert [one.effect.name for one in pruned.effects] == ["cogging", "command_dead_zone"]
    assert pruned.effects[0].form["harmonic"] == pytest.approx(9.0, abs=0.5)


@pytest.mark.parametrize(
    ("errors", "kept"),
    [({"q2+q3": 1.0, "q3": 1.0}, ("q3",)), ({"q2+q3": 1.0, "q3": 1.6}, ("q2", "q3")), ({}, ("q1", "q2", "q3"))],
    ids=["one needs it", "two", "all"],
)
def test_an_effect_stays_at_the_joints_that_need_it(errors: dict[str, float], kept: tuple[str, ...]) -> None:
    (delay,), model = fitted("command_delay", joints=("q1", "q2", "q3"))
    found = Explanation((delay,), replace(FIT, model=model), judged(1.0), 1e-9, 0.5)
    pruned = Stubbed(errors).pruned(found)
    assert pruned.effects[0].joints == kept
    assert tuple(term.joint for term in pruned.fit.model.terms) == kept


@pytest.mark.parametrize(("cost", "tried"), [(50.0, 2), (99.0, 1)])
def test_details_come_along_where_they_help_clearly(cost: float, tried: int, monkeypatch: pytest.MonkeyPatch) -> None:
    (drift,), model = fitted("friction_drift")
    monkeypatch.setattr(module, "fit", lambda problem, model, *_: SimpleNamespace(cost=cost, model=model))
    found = Stubbed({}).and_richer(FIT, [(drift, SimpleNamespace(cost=100.0, model=model))])  # type: ignore[list-item]
    assert [len(one.form) for one, _ in found] == [2, 3][:tried]


def at_first(name: str, joints: tuple[str, ...] = ("q2",), form: int = 0) -> tuple[Candidate, Model]:
    effect = find_effect(name)
    candidate = Candidate(effect, joints, forms(effect)[form])
    return candidate, candidate.added_to(Model({}, (), {}))[0]


def test_every_combination_but_the_fit_itself_is_there_once() -> None:
    candidate, model = at_first("stribeck_friction")
    starts = [tuple(one.terms[0].values[name] for name in candidate.form) for one in other_starts(candidate, model)]
    assert len(set(starts)) == len(starts) == 24
    excess, velocity = (model.terms[0].values[name] for name in candidate.form)
    assert (0.5 * excess, pytest.approx(2.0 * velocity)) in starts
    assert (excess, velocity) not in starts


def test_all_joints_of_an_effect_change_together_and_stay_within_bounds() -> None:
    candidate, model = at_first("coulomb_friction", ("q1", "q2"))
    high = {p.name: p.high for p in candidate.effect.parameters}["friction"]
    starts = [[term.values["friction"] for term in one.terms] for one in other_starts(candidate, model)]
    assert all(first == second <= high for first, second in starts)


def test_only_the_last_effect_changes() -> None:
    _, before = at_first("torque_bias")
    candidate, _ = at_first("stribeck_friction")
    model = candidate.added_to(before)[0]
    assert {one.terms[0].values["bias"] for one in other_starts(candidate, model)} == {before.terms[0].values["bias"]}


def test_ripples_and_profiles_have_no_other_starts() -> None:
    assert other_starts(*at_first("cogging")) == []
    assert other_starts(*at_first("position_torque", form=1)) == []
