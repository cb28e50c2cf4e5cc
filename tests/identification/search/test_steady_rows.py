"""How long segments may be where an error grows."""

from types import SimpleNamespace

import numpy as np
import pytest

from tactile_cube.identification.search.search import FEWEST_ROWS, GROWN, steady_rows

ROWS, SEGMENTS = 200, 20


def rows(rates: list[float]) -> int:
    """Rows of segments of 1 s in which errors of the start grow at these rates [1/s], one a segment."""
    time = np.arange(ROWS) / ROWS
    growth = np.exp(np.outer(rates, time)).reshape(1, -1)
    shooting = SimpleNamespace(
        recording=SimpleNamespace(joints=("a",)), start_sensitivity=lambda *_: np.stack([growth, growth])[..., None]
    )
    windows = SimpleNamespace(weight=np.ones((1, ROWS * SEGMENTS, 1)), segment=ROWS)
    return steady_rows(shooting, None, windows)  # type: ignore[arg-type]


def test_segments_stay_as_long_as_they_are_where_nothing_grows() -> None:
    assert rows([-3.0] * SEGMENTS) == ROWS


def test_an_unstable_machine_is_judged_over_as_long_as_its_errors_stay_small() -> None:
    assert rows([4.5] * SEGMENTS) == pytest.approx(ROWS * np.log(GROWN) / 4.5, abs=1)


def test_one_segment_that_tips_over_is_no_reason_to_cut_all() -> None:
    assert rows([0.0] * 19 + [9.0]) == ROWS
    assert rows([0.0] * 10 + [9.0] * 10) < ROWS


def test_a_segment_keeps_a_few_rows_however_fast_errors_grow() -> None:
    assert rows([1e2] * SEGMENTS) == FEWEST_ROWS
