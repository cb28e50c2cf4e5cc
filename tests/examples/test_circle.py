"""`make example` runs from the first stage to the table, and goes on where it was interrupted."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def circle(out: Path) -> str:
    command = [sys.executable, "examples/circle.py", "--smoke", "--out", str(out)]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


@pytest.mark.timeout(900)
def test_the_circle_closes_and_finished_stages_are_not_repeated(tmp_path: Path) -> None:
    circle(tmp_path)
    result = json.loads((tmp_path / "circle.json").read_text())
    assert {one["joints"][0] for one in result["effects"]} == {"q2"}
    assert list(result["evaluations"]) == ["shipped on plain", "shipped on real", "fine-tuned with the model on real"]
    assert (tmp_path / "finetune" / "policy.safetensors").is_file()
    assert "python -m" not in circle(tmp_path)
