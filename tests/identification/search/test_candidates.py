from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.effects.scales import FINGER, Scales
from tactile_cube.identification.search.candidates import Candidate, candidates
from tactile_cube.identification.search.screening import Score, resized, start
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
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
