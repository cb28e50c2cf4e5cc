import pytest

from tactile_cube.evaluation.summary import row, sentence, succeeded, summarise, wilson_interval
from tactile_cube.evaluation.verdict import EpisodeResult, judge_episode
from tests.evaluation.synthetic import episode


def results(*angles: float) -> list[EpisodeResult]:
    return [judge_episode(episode(angle=angle), episode=number) for number, angle in enumerate(angles)]


def test_success_is_a_share_of_the_best_run_for_those_that_keep_the_cube() -> None:
    lost = judge_episode(episode(angle=14.0, ending="dropped"))
    assert succeeded([*results(15.0, 12.1, 11.9, 3.0), lost], 0.8) == [True, True, False, False, False]


def test_success_without_a_share_is_regrasping_and_nothing_succeeds_when_nobody_turned() -> None:
    assert succeeded(results(5.0, 0.2), None) == [True, False]
    assert succeeded(results(-0.1, -0.2), 0.8) == [False, False]


def test_wilson_interval_of_a_published_example() -> None:
    """8 of 10: 49 to 94 %. Source: Wilson's formula, worked by hand."""
    low, high = wilson_interval(8, 10)
    assert (low, high) == (pytest.approx(0.490, abs=1e-3), pytest.approx(0.943, abs=1e-3))
    assert wilson_interval(0, 5)[0] == 0.0
    assert wilson_interval(5, 5)[1] == pytest.approx(1.0)


def test_summary_counts_and_averages() -> None:
    summary = summarise(results(4.0, 6.0, 0.1), None)
    assert summary.mean_angle == pytest.approx(10.1 / 3)
    assert (summary.best_angle, summary.successes, summary.kept) == (pytest.approx(6.0), 2, 3)
    assert summary.verdicts["regrasping"] == 2
    assert (summary.tip_support, summary.link_contact, summary.link_force_share) == (1.0, 0.0, 0.0)


def test_a_summary_says_kept_successful_and_angle_together_and_what_success_is() -> None:
    text = sentence("nominal", summarise(results(4.0, 5.0, 0.1), 0.8))
    assert (
        "nominal: 3/3 kept, 2/3 successful (95 %: 21 to 94 %; kept to the end and turned at least 80 % as far" in text
    )
    assert "3.03 +- 2.11 rad (best 5.00)" in text
    assert "three or more tips on the cube 100 % of the time, another link 0 %, with 0 % of the normal force" in text


def test_a_row_names_what_happened() -> None:
    text = row(results(4.0)[0], "hand tilted")
    assert "regrasping" in text
    assert "[hand tilted]" in text
