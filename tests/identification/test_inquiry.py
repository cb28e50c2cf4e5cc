"""What follows no model is left out where other runs of its command show nothing of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.diagnosis import (
    Answer,
    Inquiry,
    beside_disturbances,
    in_simpler_laws,
    without_needless,
)
from tactile_cube.identification.search.explanation import Proposal, named_by
from tactile_cube.identification.search.findings import Findings
from tactile_cube.identification.verdict import Simulations, Verdict
from tactile_cube.measurement.comparing.noise_floor import noise_floor
from tests.identification.rigs_of_any_size import STEP, Size, simulated

PUSHED, START, END = 2, 1.2, 1.5  # number of the trial, [s]


def test_a_push_is_left_out_and_what_is_missing_beside_it_named(tmp_path: Path) -> None:
    dry = find_effect("coulomb_friction")
    recording = simulated(tmp_path, Size(), dry, {"friction": 0.16}, repeats=3)
    trials = list(recording.trials)
    bump = 0.05 * np.sin(np.pi * np.clip((trials[PUSHED].time - START) / (END - START), 0.0, 1.0)) ** 2
    trials[PUSHED] = replace(trials[PUSHED], position=trials[PUSHED].position + bump[:, None])
    effects = (dry, find_effect("viscous_friction"))
    asked = Inquiry(recording.with_trials(trials), effects, 0, lambda line: None, None, STANDARD)
    inquiry, left_out, suspected = beside_disturbances(asked)
    (one,) = left_out
    assert (one.trial, one.repeats, suspected) == (trials[PUSHED].name, 2, ())
    assert one.start < START < END < one.end
    kept = {trial.name: trial.valid for trial in inquiry.recording.trials}
    assert not kept[one.trial][round(START / STEP) : round(END / STEP)].any()
    assert all(valid.all() for name, valid in kept.items() if name != one.trial)
    assert inquiry.answer.verdict.kind == "missing_effect"
    assert named_by(inquiry.answer.verdict.chosen.effects) == {("coulomb_friction", "a")}


def test_an_effect_that_may_be_nothing_is_no_part_of_a_claim(tmp_path: Path) -> None:
    dry, bias = find_effect("coulomb_friction"), find_effect("torque_bias")
    recording = simulated(tmp_path, Size(), dry, {"friction": 0.16}, repeats=3)
    search = Inquiry(recording, (dry, bias), 0, lambda line: None, None, STANDARD).search
    model, effects = search.base.fit.model, tuple(one for one in search.candidates if one.effect in (dry, bias))
    for one in effects:
        model, _ = one.added_to(model)
    both = search.explained(Proposal(effects, search.refitted(model)), 1)
    alone = search.explained(Proposal(effects[:1], search.refitted(effects[0].added_to(search.base.fit.model)[0])), 1)
    simulations = Simulations(search, search.base, noise_floor(recording))

    def claimed(chosen) -> set[tuple[str, str]]:
        findings = Findings(search.base, search.base.judgement, (chosen,))
        answer = Answer(search, findings, simulations, Verdict("missing_effect", chosen))
        return set(named_by(without_needless(answer).chosen.effects))

    assert named_by(both.effects) == {("coulomb_friction", "a"), ("torque_bias", "a")}
    assert claimed(both) == claimed(alone) == {("coulomb_friction", "a")}
    search.criteria = replace(STANDARD, band=np.inf)
    missed = replace(both, judgement=replace(both.judgement, costs=0.5 * both.judgement.costs))
    assert claimed(missed) == named_by(both.effects), "twice the squared error is a loss, proven or not"


@pytest.mark.parametrize(
    ("hidden", "values"),
    [("coulomb_friction", {"friction": 0.16}), ("presliding_friction", {"breakaway": 0.02, "excess": 0.16})],
)
def test_the_simpler_law_is_named_where_an_interval_reaches_it(
    tmp_path: Path, hidden: str, values: dict[str, float]
) -> None:
    dry, bristles = find_effect("coulomb_friction"), find_effect("presliding_friction")
    recording = simulated(tmp_path, Size(), find_effect(hidden), values, repeats=3)
    search = Inquiry(recording, (dry, bristles), 0, lambda line: None, None, STANDARD).search
    (richer, *_) = (one for one in search.candidates if set(one.form) == {"breakaway", "excess"})
    fit = search.refitted(richer.added_to(search.base.fit.model)[0])
    verdict = Verdict("missing_effect", search.explained(Proposal((richer,), fit), 1))
    answer = Answer(
        search,
        Findings(search.base, search.base.judgement, (verdict.chosen,)),
        Simulations(search, search.base, noise_floor(recording)),
        verdict,
    )
    assert named_by(in_simpler_laws(answer, verdict).chosen.effects) == {(hidden, "a")}
