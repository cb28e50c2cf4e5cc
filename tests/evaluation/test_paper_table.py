import json
from pathlib import Path
from typing import Any

import pytest

from tactile_cube.evaluation.paper_table import ROWS, paper_page, read_all
from tactile_cube.evaluation.results_file import FORMAT
from tactile_cube.evaluation.sweep_table import PAPER_TABLE_1
from tactile_cube.evaluation.training_curve import Curve


def results(protocol: str, label: str = "cube", angle: float = 12.0, table: bool = False) -> dict[str, Any]:
    summary = {
        "mean_angle": angle - 1,
        "std_angle": 0.5,
        "best_angle": angle,
        "successes": 9,
        "episodes": 10,
        "success_low": 0.596,
        "success_high": 0.982,
        "kept": 8,
        "verdicts": {"regrasping": 8, "dropped": 2, "holding": 0},
    }
    episode = {"final_angle": angle, "duration": 40.0, "ending": "time_limit"}
    variant = {"variant": {"name": "nominal"}, "summary": summary, "episodes": [episode]}
    return {
        "format": FORMAT,
        "created": "2026-11-21T10:00:00+00:00",
        "protocol": protocol,
        "policy": {"label": label},
        "task": {"table": table, "gravity_scale": 1.0},
        "seed": 0,
        "cpu_hours": 0.25,
        "command": f"python -m tactile_cube.evaluate protocol={protocol}",
        "variants": [variant],
    }


def line(page: str, what: str) -> str:
    return next(row for row in page.splitlines() if row.startswith(f"| {what}"))


def test_rows_that_were_not_run_give_their_command() -> None:
    page = paper_page([], [])
    assert page.count("not run") == len(ROWS) + len(PAPER_TABLE_1)
    assert "`python -m tactile_cube.evaluate protocol=endurance`" in line(page, "endurance")
    assert "Not run: `python -m tactile_cube.evaluate protocol=sim_to_sim`" in page


def test_our_number_stands_beside_the_papers() -> None:
    row = line(paper_page([results("paper")], []), "10 runs of 40 s")
    assert "robot 8/10, simulation 9/10 | 9/10 (95 %: 60 to 98 %)" in row
    assert "0.25" in row


def test_baselines_do_not_pass_for_a_trained_policy() -> None:
    page = paper_page([results("paper", "scripted", angle=2.0), results("paper", "hold", angle=0.0)], [])
    assert "not run" in line(page, "10 runs of 40 s")
    assert "best 2.0, mean 1.0 rad; 8/10 kept" in line(page, "hand-crafted")


def test_a_cube_on_a_table_does_not_pass_for_one_in_the_air() -> None:
    assert "not run" in line(paper_page([results("paper", table=True)], []), "10 runs of 40 s")


def test_the_newest_run_counts() -> None:
    page = paper_page([results("paper", angle=12.0), results("paper", angle=13.0)], [])
    assert "13.0 rad" in line(page, "best of these runs")


def test_variants_are_listed() -> None:
    assert "| nominal | 11.00 +- 0.50 | 12.00 | 8/10 | 8 regrasping, 2 dropped |" in paper_page(
        [results("sim_to_sim")], []
    )


def test_training_runs_tell_when_regrasping_began() -> None:
    columns = {
        "steps": [1e5, 2e5, 3e5],
        "final_angle": [float("nan"), 3.1, 4.0],
        "simulating_hours": [0.1, 0.2, 0.3],
        "learning_hours": [0.1, 0.2, 0.3],
    }
    assert "| table-seed0 | 0.30 | 0.20 | 0.40 | 4.00 | 0.60 |" in paper_page([], [Curve("table-seed0", columns)])


def test_results_files_are_found(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "paper.json").write_text(json.dumps(results("paper")))
    assert [one["protocol"] for one in read_all(tmp_path)] == ["paper"]
    assert read_all(tmp_path / "none") == []


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.what)
def test_every_protocol_of_the_table_exists(row: Any) -> None:
    assert (Path(__file__).parents[2] / "conf" / "protocol" / f"{row.protocol}.yaml").is_file()
