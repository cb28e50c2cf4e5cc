"""What may be missing, in which forms and from which starts; simpler and richer laws; values around a fit."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.effects.effect import FINGER, Scales
from tactile_cube.identification.search.candidates import (
    Candidate,
    Score,
    candidates,
    resized,
    start,
    with_details,
)
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model
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
def test_of_starts_that_look_as_good_the_one_nearest_its_size_is_refitted(second, taken) -> None:
    scores = [replace(SCORE, gain=1.0, factor=6.0), replace(SCORE, gain=second[0], factor=second[1])]
    assert start(scores) is scores[taken]


def test_a_single_number_starts_as_large_as_the_first_look_says() -> None:
    assert resized(SCORE).form["delay"] == pytest.approx(0.015)


def test_a_law_of_either_sign_starts_with_the_one_of_the_first_look() -> None:
    lighter = Candidate(find_effect("payload"), ("q1",), {"mass": -0.02, "distance": 0.03})
    heavier = replace(lighter, form={"mass": 0.5, "distance": 0.3})
    scores = [Score(lighter, 1.0, -0.9), Score(heavier, 0.99, 0.08)]
    assert start(scores) is scores[0]
    assert resized(scores[0]).form == pytest.approx({"mass": 0.018, "distance": 0.03})


@pytest.mark.parametrize(
    "score",
    [
        replace(SCORE, factor=50.0),
        replace(SCORE, factor=-0.9),
        replace(SCORE, candidate=Candidate(find_effect("torque_saturation"), ("q1",), {"limit": 0.1})),
    ],
    ids=["not believed", "of one sign only", "a limit is no size"],
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


def fitted(*names: str, joints: tuple[str, ...] = ("q2",)) -> tuple[list[Candidate], Model]:
    """Effects in their first forms, and a model that has them."""
    effects, model = [], Model({}, (), {})
    for name in names:
        effects.append(Candidate(find_effect(name), joints, find_effect(name).forms_at(FINGER)[0]))
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


def test_a_detail_that_changes_nothing_near_its_neutral_value_starts_elsewhere() -> None:
    """A torque limit whose softness is below 0.02 is a hard one, so no derivative leads away from there."""
    limit = Candidate(find_effect("torque_saturation"), ("q2",), {"limit": 0.1})
    model, _ = limit.added_to(Model({}, (), {}))
    found = with_details(limit, model)
    assert found is not None
    assert model.terms[0].values["softness"] == 0.0
    assert found[1].terms[0].values["softness"] == 0.3


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
