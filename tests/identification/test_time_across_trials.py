"""A machine that warms up over minutes: repeats that drift are said, are no noise, and have a law."""

from dataclasses import replace

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.search.explanation import named_by
from tactile_cube.identification.search.findings import find
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.verdict import decide
from tactile_cube.measurement.comparing.noise_floor import noise_floor
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import NOISE, Size, simulated

DRIFT = find_effect("friction_drift")
WARMING = {"friction": 0.25, "change": -0.15, "time_constant": 25.0}
"""Dry friction falls from 0.27 to 0.12 N m while the trials are played, over 77 s."""


@pytest.fixture(scope="module")
def warming(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return simulated(tmp_path_factory.mktemp("warming"), Size(), DRIFT, WARMING, repeats=4, every=11.0)


def test_repeats_that_drift_are_said_with_their_direction_and_are_no_noise(warming: Recording) -> None:
    floor = noise_floor(warming)
    (drift,) = floor.drift
    assert (drift.joint, drift.clock, drift.repeats) == ("a", True, 8)
    assert "it follows the same command better by" in drift.sentence("rad")
    assert "a minute, over 8 repeats" in drift.sentence("rad")
    behind = [float((trial.command - trial.position).std()) for trial in warming.trials]
    assert 60.0 / 66.0 * (behind[6] - behind[0]) == pytest.approx(drift.change, rel=0.5)
    assert floor.overall == pytest.approx(NOISE, rel=0.05)
    assert floor.source == "guess"


def test_trials_that_count_time_from_zero_each_drift_from_repeat_to_repeat(warming: Recording) -> None:
    (drift,) = noise_floor(warming.with_trials([_at_zero(trial) for trial in warming.trials])).drift
    assert not drift.clock
    assert "a repeat (its trials count time from 0 each)" in drift.sentence("rad")


def test_repeats_in_another_order_show_no_drift(warming: Recording) -> None:
    shuffled = np.array([3, 0, 2, 1])
    order = [2 * place + kind for place in shuffled for kind in (0, 1)]
    assert not noise_floor(warming.with_trials([_at_zero(warming.trials[k]) for k in order])).drift


def test_friction_that_falls_over_minutes_is_named_with_its_time_constant(warming: Recording) -> None:
    effects = (DRIFT, find_effect("coulomb_friction"), find_effect("viscous_friction"), find_effect("torque_gain"))
    search = Search(*held_out_split(warming), np.full(1, NOISE), effects, lambda line: None)
    verdict = decide(find(search))
    assert verdict.kind == "missing_effect"
    assert named_by(verdict.chosen.effects) == {("friction_drift", "a")}
    (term,) = verdict.chosen.fit.model.terms
    assert term.values["time_constant"] == pytest.approx(WARMING["time_constant"], rel=0.1)
    assert term.values["change"] == pytest.approx(WARMING["change"], rel=0.1)


def _at_zero(trial: Trial) -> Trial:
    return replace(trial, begun=0.0)
