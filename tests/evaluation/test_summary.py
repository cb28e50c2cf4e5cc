import pytest

from tactile_cube.evaluation.summary import row, sentence, summarise, wilson_interval
from tactile_cube.evaluation.verdict import EpisodeResult, judge_episode
from tests.evaluation.synthetic import episode


def results(*angles: float) -> list[EpisodeResult]:
    return [judge_episode(episode(angle=angle), episode=number) for number, angle in enumerate(angles)]


@pytest.mark.parametrize(
    ("angle", "steps", "success"),
    [
        (15.01, 400, True),
        (14.99, 400, False),
        (7.51, 200, True),
        (7.49, 200, False),
        (361.0, 9600, True),
        (0.0, 400, False),
    ],
)
def test_success_is_fifteen_radians_in_forty_seconds_whatever_other_episodes_did(angle, steps, success) -> None:
    assert judge_episode(episode(angle=angle, steps=steps)).success == success


def test_neither_a_lost_cube_nor_one_turned_the_other_way_is_a_success() -> None:
    assert not judge_episode(episode(angle=30.0, steps=400, ending="dropped")).success
    assert not judge_episode(episode(angle=-30.0, steps=400)).success


def test_wilson_interval_of_a_published_example() -> None:
    """8 of 10: 49 to 94 %. Source: Wilson's formula, worked by hand."""
    low, high = wilson_interval(8, 10)
    assert (low, high) == (pytest.approx(0.490, abs=1e-3), pytest.approx(0.943, abs=1e-3))
    assert wilson_interval(0, 5)[0] == 0.0
    assert wilson_interval(5, 5)[1] == pytest.approx(1.0)


def test_summary_counts_and_averages() -> None:
    summary = summarise(results(4.0, 6.0, 0.1))
    assert summary.mean_angle == pytest.approx(10.1 / 3)
    assert (summary.best_angle, summary.successes, summary.kept) == (pytest.approx(6.0), 2, 3)
    assert (summary.median_angle, summary.low_angle) == (pytest.approx(4.0), pytest.approx(0.88))
    assert summary.verdicts["regrasping"] == 2
    assert (summary.tip_support, summary.link_contact, summary.link_force_share) == (1.0, 0.0, 0.0)


def test_a_summary_says_kept_successful_and_angle_together_and_what_success_is() -> None:
    text = sentence("drawn", summarise(results(4.0, 5.0, 0.1)))
    assert "drawn: 3/3 kept, 2/3 successful (95 %: 21 to 94 %; kept to the end and turned by at least 15 rad in" in text
    assert "median 4.00 rad, lowest tenth below 0.88, mean 3.03 +- 2.11, best 5.00" in text
    assert "three or more tips on the cube 100 % of the time, another link 0 %, with 0 % of the normal force" in text


def test_a_row_names_what_happened() -> None:
    text = row(results(4.0)[0], "hand tilted")
    assert "regrasping" in text
    assert "[hand tilted]" in text
