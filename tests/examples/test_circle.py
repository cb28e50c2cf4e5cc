"""`make example` runs from the first stage to the table, and goes on where it was interrupted."""

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from examples import circle
from tests.typed import typed


@pytest.mark.timeout(900)
def test_the_circle_closes_and_finished_stages_are_not_repeated(tmp_path: Path, monkeypatch) -> None:
    """Its commands are given in this process, where a start of Python would cost more than the command."""
    given: list[str] = []

    def run(words: list[str], check: bool) -> SimpleNamespace:
        given.append(words[2].removeprefix("tactile_cube."))
        return SimpleNamespace(returncode=typed(given[-1], *words[3:]).returncode)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(circle, "subprocess", SimpleNamespace(run=run))
    monkeypatch.setattr(sys, "argv", ["circle.py", "--smoke", "--out", str(tmp_path)])
    circle.main()
    stages = ["evaluate", "evaluate", "record", "compare", "diagnose", "identify", "train", "evaluate"]
    assert given == stages
    result = json.loads((tmp_path / "circle.json").read_text())
    assert {one["joints"][0] for one in result["effects"]} == {"q2"}
    assert list(result["evaluations"]) == ["shipped on plain", "shipped on real", "fine-tuned with the model on real"]
    assert (tmp_path / "finetune" / "policy.safetensors").is_file()
    circle.main()
    assert given == stages
