"""The line that says how training goes."""

import io

import pytest

from tactile_cube.training import progress
from tactile_cube.training.progress import ProgressLine


def test_line_says_steps_rates_angle_curriculum_and_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([100.0, 101.0, 110.0, 120.0])
    monkeypatch.setattr(progress.time, "perf_counter", lambda: next(clock))
    stream = io.StringIO()
    line = ProgressLine(total=10_000, steps=1000, updates=50, stream=stream)
    summary = {"final_angle": 1.234, "episode_length": 88.0, "ended_time_limit": 0.9}
    line.stage, line.later = "stage 1 of 2", 3000
    line.show(1010, 51, summary, {"T_s": 0.25})
    assert stream.getvalue() == ""  # too soon
    line.show(4000, 1050, summary, {"T_s": 0.25})
    text = stream.getvalue()
    for part in (
        "4.0 k of 10 k steps",
        "300 steps/s",
        "100 updates/s",
        "1.23 rad",
        "88 steps",
        "T_s 0.25",
        "90 % kept",
        "stage 1 of 2",
        "| at most 0 min 30 s left",
    ):
        assert part in text
    line.later = 0
    line.show(12_000, 3000, summary, {"T_s": 0.25})  # the last barrier lies beyond the end
    assert stream.getvalue().rstrip().endswith("at most 0 min 00 s left")
