"""What each experiment composes to, pinned: a change of a default that reaches one of them shows here.

`python -m tests.contract.test_experiments` pins what they compose to now; read the difference before committing it.
"""

from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from omegaconf import OmegaConf

from tactile_cube.composition import CONFIG, composed

PINNED = Path(__file__).with_name("experiments.yaml")
EXPERIMENTS = sorted(file.stem for file in (CONFIG / "experiment").glob("*.yaml"))


def flat(tree: Any, prefix: str = "") -> dict[str, Any]:
    if not isinstance(tree, dict):
        return {prefix: tree}
    tree = {key: value for key, value in tree.items() if key != "gaits"}  # the gait's own ranges change by searching
    pairs = ((f"{prefix}.{key}" if prefix else str(key), value) for key, value in tree.items())
    return {name: leaf for key, value in pairs for name, leaf in flat(value, key).items()}


@cache
def settings(*overrides: str) -> dict[str, Any]:
    return flat(OmegaConf.to_container(composed("train", overrides)))


def departures(experiment: str) -> dict[str, Any]:
    """What an experiment changes in the published settings; `absent` where it has no such key."""
    plain, changed = settings(), settings(f"+experiment={experiment}")
    keys = sorted(plain.keys() | changed.keys())
    return {key: changed.get(key, "absent") for key in keys if changed.get(key, "absent") != plain.get(key, "absent")}


def pin() -> None:
    pinned = {experiment: departures(experiment) for experiment in EXPERIMENTS}
    head = (
        "# What each experiment of conf/experiment changes in train.yaml as it stands; written by test_experiments.py."
    )
    PINNED.write_text(f"{head}\n{yaml.safe_dump(pinned)}")


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_an_experiment_composes_to_what_is_pinned(experiment: str) -> None:
    assert departures(experiment) == yaml.safe_load(PINNED.read_text())[experiment]


def test_every_experiment_is_pinned_and_nothing_else() -> None:
    assert sorted(yaml.safe_load(PINNED.read_text())) == EXPERIMENTS


@pytest.mark.parametrize("experiment", ["alone", "hold", "wide", "steered", "taught", "contact", "finetune", "table"])
def test_a_recipe_with_published_results_fixes_what_its_bits_depend_on(experiment: str) -> None:
    chosen = settings(f"+experiment={experiment}")
    assert (chosen["collector.processes"], chosen["agent.precision"]) == (1, "bf16")


if __name__ == "__main__":
    pin()
