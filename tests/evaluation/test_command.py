"""`python -m tactile_cube.evaluate`, as a user types it."""

import json
from pathlib import Path

from tests.typed import typed


def test_a_baseline_is_judged_filmed_and_recorded(tmp_path: Path) -> None:
    words = ["policy=hold", "protocol=smoke", "protocol.seconds=1", f"hydra.run.dir={tmp_path}/run"]
    run = typed("evaluate", *words, folder=tmp_path)
    assert run.returncode == 0, run.stderr
    assert "2 holding" in run.stdout
    data = json.loads((tmp_path / "run" / "results.json").read_text())
    assert [row["verdict"] for row in data["variants"][0]["episodes"]] == ["holding", "holding"]
    for ending in (".gif", ".rrd", ".npz"):
        assert list((tmp_path / "run").glob(f"episode*{ending}")), ending


def test_the_robustness_map_is_drawn_without_a_film_too(tmp_path: Path) -> None:
    words = ["policy=hold", "protocol=perturbations", "protocol.episodes=1", "protocol.seconds=0.2", "film=false"]
    run = typed("evaluate", *words, f"hydra.run.dir={tmp_path}/run", folder=tmp_path)
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "run" / "robustness.png").stat().st_size > 10_000
    assert not list((tmp_path / "run").glob("episode*"))


def test_a_baseline_is_tried_in_the_engine_and_the_world_that_are_asked_for(tmp_path: Path) -> None:
    words = ["policy=hold", "protocol=smoke", "protocol.seconds=0.5", "film=false", "+env.constants.cube_mass=0.06"]
    angles = []
    for engine in ("bullet", "mujoco"):
        run = typed("evaluate", *words, f"engine={engine}", f"hydra.run.dir={tmp_path}/{engine}", folder=tmp_path)
        assert run.returncode == 0, run.stderr
        data = json.loads((tmp_path / engine / "results.json").read_text())
        angles.append([row["final_angle"] for row in data["variants"][0]["episodes"]])
    assert angles[0] != angles[1]
