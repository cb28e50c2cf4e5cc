"""The command line of benchmark, as a user types it."""

import json
import os
import subprocess
import sys
from pathlib import Path


def benchmark(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tactile_cube.benchmark", f"hydra.run.dir={folder}", *arguments]
    return subprocess.run(command, cwd=folder, env=os.environ, capture_output=True, text=True, timeout=280)


def test_a_section_ends_in_a_table_a_page_numbers_and_a_picture(tmp_path: Path) -> None:
    run = benchmark("sections=[update]", "rounds=1", "peers=false", folder=tmp_path)
    assert run.returncode == 0, run.stderr
    assert "| tactile_cube sac_fast, bf16 " in run.stdout
    assert "| tactile_cube sac_fast, bf16 " in (tmp_path / "benchmark.md").read_text()
    found = json.loads((tmp_path / "benchmark.json").read_text())
    assert found["machine"]["torch"]
    assert [section["name"] for section in found["sections"]] == ["update"]
    assert (tmp_path / "benchmark.png").stat().st_size > 10_000


def test_an_unknown_section_ends_with_one_line_and_exit_code_2(tmp_path: Path) -> None:
    run = benchmark("sections=[speed]", folder=tmp_path)
    assert run.returncode == 2
    assert run.stderr.startswith("error: sections=speed: no such section; choose among environment")
    assert len(run.stderr.strip().splitlines()) == 1
