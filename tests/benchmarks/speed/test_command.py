"""The benchmark of speed, as it is typed."""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]


def speed(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "benchmarks.speed", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=280)


def test_a_section_ends_in_a_table_a_page_and_numbers(tmp_path: Path) -> None:
    run = speed("update", "--rounds", "1", "--no-peers", "--out", str(tmp_path))
    assert run.returncode == 0, run.stderr
    assert "| tactile_cube plain_sac, bf16 " in run.stdout
    assert "| tactile_cube plain_sac, bf16 " in (tmp_path / "benchmark.md").read_text()
    found = json.loads((tmp_path / "benchmark.json").read_text())
    assert found["machine"]["torch"]
    assert [section["name"] for section in found["sections"]] == ["update"]
