"""The command line of export, as a user types it."""

import subprocess
import sys
from pathlib import Path


def test_an_unknown_format_is_blamed_on_the_format(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tactile_cube.export", "format=onx"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert (run.returncode, run.stderr) == (2, "error: format=onx: choose npz or onnx\n")
    assert not list(tmp_path.rglob("*.log"))
