"""The benchmark of speed, as it is typed."""

import json
import runpy
import sys
from functools import partial
from pathlib import Path

import pytest

from benchmarks.speed import update


def test_a_section_ends_in_a_table_a_page_and_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A section with a network that is small."""
    monkeypatch.setattr(update, "update", partial(update.update, calls=1, hidden=16))
    words = ["benchmarks.speed", "update", "--rounds", "1", "--no-peers", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", words)
    runpy.run_module("benchmarks.speed", run_name="__main__")
    assert "| tactile_cube plain_sac, bf16 " in capsys.readouterr().out
    assert "| tactile_cube plain_sac, bf16 " in (tmp_path / "benchmark.md").read_text()
    found = json.loads((tmp_path / "benchmark.json").read_text())
    assert found["machine"]["torch"]
    assert [section["name"] for section in found["sections"]] == ["update"]
