"""Best and worst episode of a run, side by side in one recording."""

from pathlib import Path
from typing import Any

import pytest

import tactile_cube
from tactile_cube.api.evaluation import learning_curve
from tactile_cube.errors import InputError
from tests.visualization.test_episode_recording import listed, rows


def test_best_and_worst_are_written_side_by_side_with_all_signals(tmp_path: Path) -> None:
    lines: list[str] = []
    seen = tactile_cube.view("table", episodes=2, seconds=0.4, viewer="none", folder=tmp_path, say=lines.append)
    (file,) = seen.files
    assert seen.episodes["best"].final_angle > seen.episodes["worst"].final_angle
    for name, result in seen.episodes.items():
        assert rows(file, f"/{name}/task/theta", "Scalars:scalars")[-1] == pytest.approx(result.final_angle)
        for entity in (f"/{name}/joints/ring/q", f"/{name}/policy/thumb/e_q"):
            assert rows(file, entity, "Scalars:scalars").shape[1] == 3
        assert len(rows(file, f"/{name}_hand/joint_transforms/fore_q1", "Transform3D:quaternion")) == 20
        assert f"{name}: episode {result.episode}, {result.final_angle:.2f} rad" in seen.text
    (words,) = listed(file, "/run", "TextDocument:text")
    assert words[0].startswith("## table")
    assert f"rerun {file}" in seen.text
    assert any("policy table" in line for line in lines)


def test_recordings_that_are_there_already_are_opened_without_an_episode(tmp_path: Path) -> None:
    (tmp_path / "comparison.rrd").write_bytes(b"")
    seen = tactile_cube.view(tmp_path, viewer="none")
    assert seen.files == [tmp_path / "comparison.rrd"]
    assert not seen.episodes


@pytest.mark.parametrize(
    ("run", "settings", "message"),
    [
        ("nowhere", {}, "run=nowhere: no such file; give a policy file, a run folder"),
        ("table", {"viewer": "tv"}, "viewer=tv: choose one of"),
        ("table", {"episodes": 1}, "episodes=1: give at least 2"),
        ("table", {"evaluate": {"taks": "full"}}, "taks"),
    ],
)
def test_what_cannot_be_seen_is_told_in_one_line(run: str, settings: Any, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message) as told:
        tactile_cube.view(run, **settings, folder=tmp_path, say=lambda line: None)
    assert "\n" not in str(told.value)


def test_a_run_that_has_only_begun_has_no_learning_curve_yet(tmp_path: Path) -> None:
    assert learning_curve(tmp_path) is None
    (tmp_path / "metrics.csv").write_text("")
    assert learning_curve(tmp_path) is None
    (tmp_path / "metrics.csv").write_text("steps,final_angle\n100,0.5\n")
    curve = learning_curve(tmp_path)
    assert curve is not None
    assert curve.columns["final_angle"] == [0.5]
