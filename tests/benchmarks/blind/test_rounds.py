"""A round is drawn with the files of its key, or not at all."""

import sys
from pathlib import Path

import pytest
import yaml

from benchmarks.blind import rounds


def test_files_that_changed_after_the_key_are_named() -> None:
    now = rounds.sums()
    assert rounds.changed({"files": now}) == []
    other = {**now, "scoring.py": "0", "gone.py": "0"}
    del other["logs.py"]
    assert rounds.changed({"files": other}) == ["gone.py", "logs.py", "scoring.py"]


def test_nothing_is_drawn_by_another_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    key = {"rounds": {"own": "benchmarks.blind.judge --draws 1 --first-seed 1"}, "files": {"scoring.py": "0"}}
    monkeypatch.setattr(rounds, "KEY", tmp_path / "key.yaml")
    monkeypatch.setattr(sys, "argv", ["rounds", "--out", str(tmp_path / "out")])
    rounds.KEY.write_text(yaml.safe_dump(key))
    with pytest.raises(SystemExit, match=r"scoring\.py.* changed after the key"):
        rounds.main()
    assert not (tmp_path / "out").exists()
