import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.paper.model_card import (
    Ancestor,
    ancestry_table,
    in_words,
    model_card,
    read_ancestry,
    read_card,
    read_table,
    total,
)
from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import PolicyInfo, load_actor, save_policy
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policy_path import SHIPPED
from tests.benchmarks.paper.test_page import results

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
    Ancestor("search_gait", 5000, 0.25, 0.5),
    Ancestor("curriculum", 1_000_000, 4.5, 3.0, in_words(TAUGHT), "abc122"),
    Ancestor("finetune", 500_000, 1.0, 1.0, in_words(ALONE), "abc123"),
]
LEDGER = {"simulating_hours": 1.5, "learning_hours": 2, "wall_hours": 3, "steps": 9}
SEARCH = {"name": "search_gait-seed0", "steps": 70, "cpu_hours": 0.25, "wall_hours": 0.5, "commit": "abc121"}


def run(folder: Path, **config: Any) -> Path:
    """The folder of a training run."""
    folder.mkdir(exist_ok=True)
    (folder / "ledger.json").write_text(json.dumps(LEDGER))
    actor = Actor(Sizes(6, 3, 2), (8,))
    info = PolicyInfo.describe(actor, commit="abc", config=TAUGHT | config)
    save_policy(folder / "policy.safetensors", actor, info)
    return folder


def test_the_card_says_how_it_was_made_and_what_it_does() -> None:
    result = results("paper", angle=15.5)
    result["variants"][0]["summary"]["exploits"] = {}
    card = model_card("default", INFO, RUNS, [result], "")
    for fact in (
        "full, T_s 0.5 s",
        "1 000 000 (curriculum), then 500 000 (finetune)",
        "abc123",
        "5.75 (4.50 h on the clock)",
        "8/10 successful",
        "Successful: kept to the end and turned by at least 15 rad in 40 s",
        "simulation only",
    ):
        assert fact in card


def test_the_ancestry_lists_each_run_with_its_settings() -> None:
    searched, taught, alone = (row.strip("| ").split(" | ") for row in ancestry_table(RUNS)[2:])
    assert searched[:4] == ["search_gait", "5 000", "0.25", "0.5"]
    assert taught[4:9] == [
        "fresh networks",
        "a scripted gait in 30 % of the episodes, imitated with weight 2",
        "spin 16, tilt 5",
        "0.95, 3-step returns",
        "turned by up to 0.75 rad",
    ]
    assert alone[2:6] == ["1", "1", "outputs/train/curriculum-seed0", "none"]


def test_the_ancestry_is_read_back_from_a_card() -> None:
    runs = [Ancestor("search_gait"), *RUNS[1:]]
    assert read_table(model_card("default", INFO, runs, [], "")) == runs


def test_a_run_that_a_gait_taught_brings_the_hours_of_its_search(tmp_path: Path) -> None:
    taught = run(tmp_path / "taught", exploration={"demonstrations": 0.3, "gaits": {"search": SEARCH}})
    search, own = read_ancestry([taught])
    assert search == Ancestor(**SEARCH)
    assert own == Ancestor("taught", 9, 3.5, 3.0, in_words(TAUGHT), "abc")
    assert total([search, own]) == "3.75 (3.50 h on the clock)"


def test_of_a_gait_from_before_searches_were_booked_the_cost_is_called_unknown(tmp_path: Path) -> None:
    runs = read_ancestry([run(tmp_path / "taught")])
    assert runs[0] == Ancestor("search_gait")
    assert total(runs) == "3.50 (3.00 h on the clock), without search_gait (not recorded)"


def test_a_search_that_is_named_besides_counts_once(tmp_path: Path) -> None:
    folder = tmp_path / SEARCH["name"]
    folder.mkdir()
    (folder / "ledger.json").write_text(json.dumps(LEDGER | {"steps": SEARCH["steps"]}))
    taught = run(tmp_path / "taught", exploration={"demonstrations": 0.3, "gaits": {"search": SEARCH}})
    assert [one.name for one in read_ancestry([folder, taught])] == [folder.name, "taught"]


def test_a_run_brings_the_run_that_it_began_with(tmp_path: Path) -> None:
    first = run(tmp_path / "first", exploration={})
    second = run(tmp_path / "second", exploration={}, training={"init_from": str(first / "checkpoint.pt")})
    assert [one.name for one in read_ancestry([second])] == ["first", "second"]
    assert [one.name for one in read_ancestry([first, second])] == ["first", "second"]


def test_a_run_that_began_with_a_policy_of_the_package_brings_its_ancestry(tmp_path: Path) -> None:
    tuned = run(tmp_path / "tuned", exploration={}, training={"init_from": "published"})
    whole = read_ancestry([tuned])
    assert [one.name for one in whole] == ["search_gait", "curriculum-seed0", "finetune-seed0", "tuned"]


def test_a_beginning_that_is_gone_is_called_so(tmp_path: Path) -> None:
    tuned = run(tmp_path / "tuned", exploration={}, training={"init_from": "outputs/train/gone-seed0/checkpoint.pt"})
    assert read_ancestry([tuned])[0] == Ancestor("gone-seed0")


@pytest.mark.parametrize("card", sorted(SHIPPED.glob("*.md")), ids=lambda card: card.stem)
def test_the_card_of_a_shipped_policy_counts_its_whole_ancestry(card: Path) -> None:
    runs = read_table(card.read_text())
    assert read_card(card)["CPU hours"] == total(runs)
    assert load_actor(card.with_suffix(".safetensors"))[1].commit == runs[-1].commit
    for index, one in enumerate(runs):
        earlier = {run.name for run in runs[:index]}
        begun = one.settings.get("begins with", "fresh networks")
        assert begun == "fresh networks" or {Path(begun).name, Path(begun).parent.name} & earlier
        assert "gait" not in one.shown or "search_gait" in earlier


@pytest.mark.parametrize("content", ["", "{}", "[]"])
def test_another_file_is_no_ledger(tmp_path: Path, content: str) -> None:
    (tmp_path / "ledger.json").write_text(content)
    with pytest.raises(InputError, match=r"ledger\.json"):
        read_ancestry([tmp_path])
