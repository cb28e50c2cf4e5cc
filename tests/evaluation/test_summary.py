import pytest

from tactile_cube.evaluation.summary import row, sentence, succeeded, summarise, wilson_interval
from tactile_cube.evaluation.verdict import EpisodeResult, judge
from tests.evaluation.synthetic import episode


def results(*angles: float) -> list[EpisodeResult]:
    return [judge(episode(angle=angle), episode=number) for number, angle in enumerate(angles)]


def test_success_is_a_share_of_the_best_run() -> None:
    assert succeeded(results(15.0, 12.1, 11.9, 3.0), 0.8) == [True, True, False, False]


def test_success_without_a_share_is_regrasping() -> None:
    assert succeeded(results(5.0, 0.2), None) == [True, False]


def test_nothing_succeeds_when_nobody_turned() -> None:
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
    assert "2/3 successful" in sentence("nominal", summary)


def test_a_row_names_what_happened() -> None:
    text = row(results(4.0)[0], "hand tilted")
    assert "regrasping" in text
    assert "[hand tilted]" in text
