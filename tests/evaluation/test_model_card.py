import json
from pathlib import Path

import pytest

from tactile_cube.agent.policy_file import PolicyInfo
from tactile_cube.errors import InputError
from tactile_cube.evaluation.model_card import model_card, read_costs
from tests.evaluation.test_paper_table import results

INFO = PolicyInfo(
    observation_size=120,
    action_size=12,
    hidden=(512, 512),
    seed=3,
    steps=1_500_000,
    commit="abc123",
    config={"task": {"name": "full", "filter_time": 0.5, "gravity_scale": 1.0}},
)


def test_the_card_says_how_it_was_made_and_what_it_does() -> None:
    result = results("paper")
    result["variants"][0]["summary"]["exploits"] = {}
    runs = {
        "curriculum": {"steps": 1_000_000, "simulating": 1.5, "learning": 3.0, "wall": 3.0},
        "finetune": {"steps": 500_000, "simulating": 0.5, "learning": 0.5, "wall": 1.0},
    }
    card = model_card("default", INFO, runs, [result], "")
    for fact in (
        "full, T_s 0.5 s",
        "1 000 000 (curriculum), then 500 000 (finetune)",
        "abc123",
        "5.50 (4.00 h on the clock)",
        "9/10 successful",
        "simulation only",
    ):
        assert fact in card


def test_a_ledger_gives_the_costs(tmp_path: Path) -> None:
    (tmp_path / "ledger.json").write_text(
        json.dumps({"simulating_hours": 1.5, "learning_hours": 2, "wall_hours": 3, "steps": 9})
    )
    assert read_costs(tmp_path) == {"steps": 9, "simulating": 1.5, "learning": 2.0, "wall": 3.0}


@pytest.mark.parametrize("content", ["", "{}", "[]"])
def test_another_file_is_no_ledger(tmp_path: Path, content: str) -> None:
    (tmp_path / "ledger.json").write_text(content)
    with pytest.raises(InputError, match=r"ledger\.json"):
        read_costs(tmp_path)
