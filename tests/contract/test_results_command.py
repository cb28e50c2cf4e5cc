"""`python -m tactile_cube.results` as a user types it."""

import subprocess
import sys
from pathlib import Path

RESULTS = Path(__file__).parents[2] / "docs" / "results"


def test_page_and_picture_are_written_into_folders_that_were_not_there(tmp_path: Path) -> None:
    page, picture = tmp_path / "a" / "page.md", tmp_path / "b" / "curves.png"
    curve = next((RESULTS / "curriculum" / "curves").glob("*.csv"))
    words = [f"runs={RESULTS / 'runs'}", f"page={page}", f"picture={picture}", f"curves=[{curve}]", "table1=null"]
    command = [
        sys.executable,
        "-m",
        "tactile_cube.results",
        *words,
        "free_finger=null",
        f"hydra.run.dir={tmp_path / 'run'}",
    ]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=tmp_path, check=False)
    assert run.returncode == 0, run.stderr
    assert "10 runs of 40 s" in page.read_text(encoding="utf-8")
    assert picture.stat().st_size > 10_000
