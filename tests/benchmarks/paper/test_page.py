"""Rows of the paper's page; what the page in the docs shows is compared in test_commands.py."""

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.paper.budget import POLICIES, WORLDS, read_budget
from benchmarks.paper.page import DIFFERENCES, paper_page
from benchmarks.paper.rows import HEAD, ROWS, read_comparison, read_results
from tactile_cube.errors import InputError
from tactile_cube.evaluation.evaluation import FORMAT


def results(protocol: str, label: str = "cube", angle: float = 12.0, table: bool = False) -> dict[str, Any]:
    summary = {
        "mean_angle": angle - 1,
        "std_angle": 0.5,
        "best_angle": angle,
        "episodes": 10,
        "kept": 8,
        "verdicts": {"regrasping": 8, "dropped": 2, "holding": 0},
    }
    kept = {"duration": 40.0, "ending": "time_limit"}
    angles = [*[angle] * 8, 0.79 * angle]
    episodes = [*(kept | {"final_angle": one} for one in angles), kept | {"final_angle": angle, "ending": "dropped"}]
    variant = {"variant": {"name": "nominal"}, "summary": summary, "episodes": episodes}
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
    page = paper_page([])
    assert page.count("not run") == len(ROWS) + 1
    assert "`python -m tactile_cube.evaluate protocol=endurance`" in line(page, "endurance")
    assert "Not run: `python -m tactile_cube.evaluate protocol=sim_to_sim`" in page
    assert "robustness.png" not in page


@pytest.mark.parametrize(
    ("given", "filled", "says", "missing"),
    [
        ([results("paper", "scripted", angle=2.0), results("paper", "hold", angle=0.0)], "hand-crafted",
         "best 2.0, mean 1.0 rad; 8/10 kept", "10 runs of 40 s"),
        ([results("standard", "replay of episode0.npz", angle=3.0)], "the replay in other worlds",
         "best 3.0, mean 2.0 rad; 8/10 kept", "the policy in the same worlds"),
        ([results("paper", table=True), results("paper", "scripted")], "hand-crafted", "kept", "10 runs of 40 s"),
    ],
    ids=["baselines", "a replay", "on a table"],
)  # fmt: skip
def test_what_is_no_run_of_the_policy_does_not_pass_for_one(given, filled, says, missing) -> None:
    page = paper_page(given)
    assert says in line(page, filled)
    assert "not run" in line(page, missing)


def test_the_papers_own_rule_counts_no_hand_that_never_moves() -> None:
    assert "0/10 as far" in line(paper_page([results("paper", angle=0.0)]), "10 runs of 40 s")


def test_what_is_written_by_hand_stays_where_it_stands() -> None:
    before = f"# Title\n\nContact.\n\n{HEAD}\noutdated\n\n{DIFFERENCES}\n\n- One.\n\n## Old\n\noutdated"
    written = paper_page([], written=before)
    assert written.startswith(f"# Title\n\nContact.\n\n{HEAD}")
    assert f"\n\n{DIFFERENCES}\n\n- One.\n\n## What a gait earns and pays\n" in written
    assert written.index("What a gait earns") < written.index("## Robustness")
    assert "outdated" not in written
    assert paper_page([], written=written) == written


def test_a_dirty_tree_is_called_one() -> None:
    clean, dirty = (paper_page([results("paper") | {"commit": name}]) for name in ("abc123", "abc123-dirty"))
    assert "working tree" not in clean
    assert "had changes in its working tree" in dirty


def test_the_newest_run_counts() -> None:
    page = paper_page([results("paper", angle=12.0), results("paper", angle=13.0)])
    assert "13.0 rad" in line(page, "best of these runs")


def test_a_comparison_without_a_band_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "comparison.json"
    file.write_text(json.dumps({"band": None}))
    with pytest.raises(InputError, match=r"no band of randomised simulations; run compare with band\.simulations=50"):
        read_comparison(file)


def test_the_budgets_terms_add_up_to_the_return() -> None:
    rows, total = read_budget(), ("spin", "height", "plane", "tilt", "proximal")
    assert len(rows) == len(POLICIES) * len(WORLDS)
    lost = 10.0  # published nowhere, conf/reward/paper.yaml
    for row in rows:
        assert row["return"] == pytest.approx(sum(row[key] for key in total) - lost * (1.0 - row["held"]), abs=0.05)


@pytest.mark.parametrize(
    "content", ["", "[]", "{}", '{"format": "tactile_cube results 1"}', '{"format": "something else"}', "{"]
)
def test_other_files_are_refused_by_name(tmp_path: Path, content: str) -> None:
    path = tmp_path / "results.json"
    path.write_text(content)
    with pytest.raises(InputError, match=r"results\.json"):
        read_results(path)
