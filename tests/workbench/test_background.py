"""A diagnosis in a process of its own."""

import time
from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.workbench.background import Diagnosing
from tests.workbench.small_bench import STRIBECK, stribeck_recording


def test_a_diagnosis_tells_its_progress_and_its_answer(tmp_path: Path) -> None:
    running = Diagnosing(stribeck_recording(tmp_path), None, (), 0, tmp_path / "found")
    assert any("best so far" in line for line in list(running.lines()))
    assert running.found is not None
    assert running.found.effects == [STRIBECK]
    assert (tmp_path / "found" / "report.html").is_file()


def test_a_diagnosis_is_stopped_at_once(tmp_path: Path) -> None:
    running = Diagnosing(stribeck_recording(tmp_path), None, (), 0, tmp_path / "found")
    lines = running.lines()
    next(lines)
    began = time.monotonic()
    running.stop()
    rest = list(lines)
    assert running.found is None
    assert len(rest) < 5
    assert time.monotonic() - began < 5.0


def test_what_diagnose_refuses_is_raised_here(tmp_path: Path) -> None:
    recording = stribeck_recording(tmp_path)
    running = Diagnosing(recording.with_trials(recording.trials[:1]), None, (), 0, tmp_path / "found")
    with pytest.raises(InputError, match="1 trial in all"):
        running.wait()
