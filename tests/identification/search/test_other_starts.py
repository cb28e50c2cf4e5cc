"""Values around a fit, from which it is tried again."""

import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.search.candidates import Candidate, forms
from tactile_cube.identification.search.relatives import other_starts
from tactile_cube.measurement.replay.model import Model


def fitted(name: str, joints: tuple[str, ...] = ("q2",), form: int = 0) -> tuple[Candidate, Model]:
    effect = find_effect(name)
    candidate = Candidate(effect, joints, forms(effect)[form])
    return candidate, candidate.added_to(Model({}, (), {}))[0]


def test_every_combination_but_the_fit_itself_is_there_once() -> None:
    candidate, model = fitted("stribeck_friction")
    starts = [tuple(one.terms[0].values[name] for name in candidate.form) for one in other_starts(candidate, model)]
    assert len(set(starts)) == len(starts) == 24
    excess, velocity = (model.terms[0].values[name] for name in candidate.form)
    assert (0.5 * excess, pytest.approx(2.0 * velocity)) in starts
    assert (excess, velocity) not in starts


def test_all_joints_of_an_effect_change_together_and_stay_within_bounds() -> None:
    candidate, model = fitted("coulomb_friction", ("q1", "q2"))
    high = {p.name: p.high for p in candidate.effect.parameters}["friction"]
    starts = [[term.values["friction"] for term in one.terms] for one in other_starts(candidate, model)]
    assert all(first == second <= high for first, second in starts)


def test_only_the_last_effect_changes() -> None:
    _, before = fitted("torque_bias")
    candidate, _ = fitted("stribeck_friction")
    model = candidate.added_to(before)[0]
    assert {one.terms[0].values["bias"] for one in other_starts(candidate, model)} == {before.terms[0].values["bias"]}


def test_ripples_and_profiles_have_no_other_starts() -> None:
    assert other_starts(*fitted("cogging")) == []
    assert other_starts(*fitted("position_torque", form=1)) == []
