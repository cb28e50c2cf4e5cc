import json
from pathlib import Path

import pytest

from tactile_cube.agent.batch import Sizes
from tactile_cube.agent.networks import Actor
from tactile_cube.agent.policy_file import PolicyInfo, save_policy
from tactile_cube.errors import InputError
from tactile_cube.evaluation.ancestry import Ancestor, ancestry_table, read_ancestor
from tactile_cube.evaluation.model_card import model_card, read_card
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
TAUGHT = {
    "exploration": {"demonstrations": 0.3},
    "agent": {"demonstration_weight": 2, "gamma": 0.95, "n_step": 3},
    "reward": {"_target_": "tactile_cube.env.Reward", "spin": 16, "tilt": 5, "off_centre": 0},
    "start": {"yaw_range": 0.75},
    "training": {"init_from": None},
}
ALONE = {"training": {"init_from": "outputs/train/curriculum-seed0"}, "agent": {"demonstration_weight": 0}}
RUNS = [
    Ancestor("search_gait", 5000, {"simulating": 0.25, "learning": 0.0, "wall": 0.5}),
    Ancestor("curriculum", 1_000_000, {"simulating": 1.5, "learning": 3.0, "wall": 3.0}, TAUGHT, "abc122"),
    Ancestor("finetune", 500_000, {"simulating": 0.5, "learning": 0.5, "wall": 1.0}, ALONE, "abc123"),
]
LEDGER = {"simulating_hours": 1.5, "learning_hours": 2, "wall_hours": 3, "steps": 9}


def test_the_card_says_how_it_was_made_and_what_it_does() -> None:
    result = results("paper")
    result["variants"][0]["summary"]["exploits"] = {}
    card = model_card("default", INFO, RUNS, [result], "")
    for fact in (
        "full, T_s 0.5 s",
        "1 000 000 (curriculum), then 500 000 (finetune)",
        "abc123",
        "5.75 (4.50 h on the clock)",
        "9/10 successful",
        "simulation only",
    ):
        assert fact in card


def test_the_card_of_a_fine_tuned_policy_names_the_teacher_of_the_run_before(tmp_path: Path) -> None:
    (tmp_path / "card.md").write_text(model_card("default", INFO, RUNS, [], ""))
    taught = "a scripted gait in 30 % of the episodes, imitated with weight 2 (curriculum)"
    assert read_card(tmp_path / "card.md")["teacher"] == taught


def test_the_ancestry_lists_each_run_with_its_settings() -> None:
    searched, taught, alone = (row.strip("| ").split(" | ") for row in ancestry_table(RUNS)[2:])
    assert searched[:3] == ["search_gait", "5 000", "0.25"]
    assert taught[3:8] == [
        "fresh networks",
        "a scripted gait in 30 % of the episodes, imitated with weight 2",
        "spin 16, tilt 5",
        "0.95, 3-step returns",
        "turned by up to 0.75 rad",
    ]
    assert alone[2:5] == ["1.00", "outputs/train/curriculum-seed0", "none"]


def test_a_policy_that_taught_is_named() -> None:
    shown = {"exploration": {"demonstrations": 0.3, "teacher": "policies/default.safetensors"}}
    run = Ancestor("contact", 9, RUNS[0].hours, shown)
    assert run.teacher == "the policy default in 30 % of the episodes, imitated with weight 0"


def test_a_run_is_read_from_its_ledger_and_its_policy(tmp_path: Path) -> None:
    (tmp_path / "ledger.json").write_text(json.dumps(LEDGER))
    hours = {"simulating": 1.5, "learning": 2.0, "wall": 3.0}
    assert read_ancestor(tmp_path) == Ancestor(tmp_path.name, 9, hours)
    actor = Actor(Sizes(6, 3, 2), (8,))
    save_policy(tmp_path / "policy.safetensors", actor, PolicyInfo.describe(actor, commit="abc", config=TAUGHT))
    assert read_ancestor(tmp_path) == Ancestor(tmp_path.name, 9, hours, TAUGHT, "abc")


@pytest.mark.parametrize("content", ["", "{}", "[]"])
def test_another_file_is_no_ledger(tmp_path: Path, content: str) -> None:
    (tmp_path / "ledger.json").write_text(content)
    with pytest.raises(InputError, match=r"ledger\.json"):
        read_ancestor(tmp_path)
