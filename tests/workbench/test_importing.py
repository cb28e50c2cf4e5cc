"""Logs on their way into the workbench."""

from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.workbench import importing
from tactile_cube.workbench.importing import import_logs, kept, preview
from tests.measurement.small_rig import URDF

GAINS = {"kp": 3.0, "kd": 0.2}
HEAD = "t,a_cmd,a_pos,b_cmd,b_pos\n"
ROWS = [f"{0.01 * k:.2f},0.{k % 7},0.{k % 7},0.{k % 5},0.{k % 5}" for k in range(200)]


def log(folder: Path, text: str) -> tuple[Path, Path]:
    return kept(folder, "run.csv", text.encode()), kept(folder, "rig.urdf", URDF.encode())


def test_a_preview_shows_rows_and_guesses_columns(tmp_path: Path) -> None:
    seen = preview(*log(tmp_path, HEAD + "\n".join(ROWS)))
    assert seen.joints == ["a", "b"]
    assert seen.columns == ["t", "a_cmd", "a_pos", "b_cmd", "b_pos"]
    assert seen.rows[1] == [0.01, 0.1, 0.1, 0.1, 0.1]
    assert seen.guess is not None
    assert seen.guess.joints["b"] == {"command": "b_cmd", "position": "b_pos"}


def test_what_the_names_leave_open_is_a_doubt_and_no_error(tmp_path: Path) -> None:
    seen = preview(*log(tmp_path, (HEAD + "\n".join(ROWS)).replace("a_", "x_").replace("b_", "y_")))
    assert seen.guess is None
    assert "of which joint" in seen.doubt


def test_columns_that_are_said_are_taken(tmp_path: Path) -> None:
    file, urdf = log(tmp_path, HEAD + "\n".join(ROWS))
    swapped = {"time": "t", "a": {"command": "b_cmd", "position": "b_pos"}}
    recording, understood = import_logs(tmp_path / "out", [file], urdf, GAINS, columns=swapped)
    assert recording.joints == ("a",)
    assert any(line.startswith("guess: a command: b_cmd [rad] (values") for line in understood)


def test_an_error_names_the_row(tmp_path: Path) -> None:
    file, urdf = log(tmp_path, HEAD + "\n".join([*ROWS[:50], ROWS[20], *ROWS[51:]]))
    with pytest.raises(InputError, match=r"run.csv: column 't', row 50: time runs backwards"):
        import_logs(tmp_path / "out", [file], urdf, GAINS)
    assert not (tmp_path / "out").exists()


def test_of_a_dropped_files_name_only_the_last_part_counts(tmp_path: Path) -> None:
    for name in ("../../out.csv", "/etc/out.csv", "..\\..\\out.csv"):
        assert kept(tmp_path / "dropped", name, b"t\n") == tmp_path / "dropped" / "out.csv"


def test_other_files_and_large_ones_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"effect.py: neither a log \(.csv, .txt, .parquet, .npz\) nor a mechanism"):
        kept(tmp_path, "effect.py", b"")
    with pytest.raises(InputError, match=r"run.mcap: a ROS bag; .*record source=mcap 'source.files=\[run.mcap\]'"):
        kept(tmp_path, "run.mcap", b"")
    monkeypatch.setattr(importing, "LARGEST", 10)
    with pytest.raises(InputError, match=r"large.csv: .* name its path instead"):
        kept(tmp_path, "large.csv", b"0" * 11)
    assert not list(tmp_path.iterdir())
