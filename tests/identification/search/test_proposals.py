"""What is refitted, from where and how often: laws with all that they can say, and simpler laws beside a table."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.fitting.unknowns import read_all
from tactile_cube.identification.search.explanation import Proposal, named_by
from tactile_cube.identification.search.findings import find
from tactile_cube.identification.search.proposals import (
    SHARES,
    grown,
    look,
    near,
    refit,
    refitted,
    stepped,
    whole,
    without,
)
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.verdict import decide
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import NOISE, Size, simulated


def searched(folder: Path, values: dict[str, float], names: tuple[str, ...] = ("mount_tilt",)) -> Search:
    """A search that knows these effects, of which the first one is hidden with `values`, and a table of torques."""
    recording = simulated(folder, Size(), find_effect(names[0]), values)
    effects = tuple(find_effect(name) for name in (*names, "position_torque"))
    return Search(*held_out_split(recording), np.full(1, NOISE), effects, lambda line: None)


def test_a_mount_tilted_about_both_axes_is_no_table_of_torques(tmp_path: Path) -> None:
    verdict = decide(find(searched(tmp_path, {"first": 0.1, "second": 0.3})))
    assert named_by(verdict.chosen.effects) == {("mount_tilt", "a")}
    assert verdict.chosen.error == pytest.approx(1.0, abs=0.05)


def test_a_simpler_law_is_refitted_beside_a_table_at_the_noise_floor(tmp_path: Path) -> None:
    search = searched(tmp_path, {"first": 0.3})
    looks = look(search, Proposal((), search.base.fit), ["a"])
    table = next(law for law in looks.tried if law[0].effect.name == "position_torque")
    tilt = next(candidate for candidate, _ in looks.tried if candidate.effect.name == "mount_tilt")
    unmoved = stepped(looks.problem, looks.frozen, tilt, 0)
    found = grown(search, replace(looks, tried=[table, unmoved]))
    (alone,) = (one for one in found if named_by(one.effects) == {("position_torque", "a")} and whole(search, [one]))
    assert not near(looks, unmoved[1].cost, [alone])
    assert {("mount_tilt", "a")} in [named_by(one.effects) for one in found if whole(search, [one])]


def test_a_table_that_is_worse_is_tried_as_the_spring_that_it_contains(tmp_path: Path) -> None:
    verdict = decide(find(searched(tmp_path, {"error": -0.1}, ("torque_gain", "payload"))))
    assert named_by(verdict.chosen.effects) == {("torque_gain", "a")}
    names = {frozenset(one.effects[-1].form) for one in verdict.rivals}
    assert names == {frozenset({"mass", "distance"}), frozenset({"stiffness", "bias"})}


def test_a_mount_tilted_about_the_axis_that_only_takes_weight_away_is_beside_a_torque_gain(tmp_path: Path) -> None:
    verdict = decide(find(searched(tmp_path, {"first": 0.26}, ("mount_tilt", "torque_gain"))))
    named = {named_by(one.effects) for one in (verdict.chosen, *verdict.rivals)}
    assert {frozenset({("mount_tilt", "a")}), frozenset({("torque_gain", "a")})} <= named


def test_a_refit_begins_where_the_laws_own_steps_led_and_adds_what_they_move_of_the_constants(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    search = searched(tmp_path, {"error": -0.1}, ("torque_gain", "payload"))
    looks = look(search, Proposal((), search.base.fit), ["a"])
    begun = []
    monkeypatch.setattr(search, "refitted", lambda model: begun.append(model) or search.base.fit)
    monkeypatch.setattr(search, "cost", lambda model: 0.0)
    laws = [next(law for law in looks.tried if law[0].effect.name == name) for name in ("torque_gain", "payload")]
    refitted(search, looks, (laws[0],))
    refitted(search, looks, tuple(laws))
    constants = looks.frozen.unknowns
    before, *own = (read_all(model, constants) for model in (looks.frozen.model, *(fitted.model for _, fitted in laws)))
    assert np.abs(own[0] - before).max() > 0.0
    alone, both = (read_all(model, constants) for model in begun)
    assert alone == pytest.approx(own[0])
    low, high = (np.array([getattr(one, end) for one in constants]) for end in ("low", "high"))
    assert both == pytest.approx(np.clip(own[0] + own[1] - before, low, high))
    assert [term.effect.name for term in begun[1].terms] == ["torque_gain", "payload"]
    monkeypatch.setattr(search, "cost", lambda model: np.inf)
    refitted(search, looks, (laws[0],))
    assert read_all(begun[2], constants) == pytest.approx(before + SHARES[-1] * (own[0] - before))
    assert begun[2].terms[0].values["error"] == SHARES[-1] * begun[0].terms[0].values["error"]


def test_a_law_fits_no_worse_with_its_details_free(tmp_path: Path) -> None:
    """From this exponent a first step leads where other initial states fit, and the error is half as large again."""
    stribeck = find_effect("stribeck_friction")
    recording = simulated(tmp_path, Size(), stribeck, {"excess": 0.15, "velocity": 0.1, "exponent": 0.5})
    search = Search(*held_out_split(recording), np.full(1, NOISE), (stribeck,), lambda line: None)
    plain, detailed = sorted(
        grown(search, look(search, Proposal((), search.base.fit), ["a"])), key=lambda one: one.effects[0].size
    )
    assert set(detailed.effects[0].form) > set(plain.effects[0].form)
    assert detailed.fit.cost <= plain.fit.cost


def test_a_set_that_was_refitted_before_is_not_simulated_again(tmp_path: Path) -> None:
    search = searched(tmp_path, {"error": -0.1}, ("torque_gain", "payload"))
    looks = look(search, Proposal((), search.base.fit), ["a"])
    laws = [next(law for law in looks.tried if law[0].effect.name == name) for name in ("torque_gain", "payload")]
    alone, both = refitted(search, looks, (laws[0],)), refitted(search, looks, tuple(laws))
    before = search.shooting.simulated
    assert without(search, both, 1) is alone
    assert search.shooting.simulated == before
    assert named_by(without(search, both, 0).effects) == {("payload", "a")}
    assert search.shooting.simulated > before


def test_a_refit_from_a_bad_start_does_not_replace_a_better_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    search = searched(tmp_path, {"error": -0.1}, ("torque_gain",))
    gain = next(one for one in search.candidates if one.effect.name == "torque_gain")
    model, _ = gain.added_to(search.base.fit.model)
    good = refit(search, (gain,), model)
    monkeypatch.setattr(search, "refitted", lambda model: replace(good.fit, cost=2.0 * good.fit.cost))
    assert refit(search, (gain,), model) is good
