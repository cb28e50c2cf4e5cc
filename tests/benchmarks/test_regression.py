"""Recordings that a search may be changed by: none of them may judge it."""

import gzip
import inspect
import json
from pathlib import Path

from benchmarks.blind.generator import write
from benchmarks.regression.__main__ import draws
from benchmarks.regression.recall import holds

ROUNDS = Path(__file__).parents[2] / "docs" / "results" / "data" / "rounds"


def test_every_seed_was_drawn_in_a_published_round() -> None:
    lines = [line for path in ROUNDS.glob("*.jsonl.gz") for line in gzip.decompress(path.read_bytes()).splitlines()]
    spent = {json.loads(line)["seed"] for line in lines}
    seeds = [draw["seed"] for draw in draws()]
    assert set(seeds) <= spent
    assert len(set(seeds)) == len(seeds)


def test_every_draw_says_what_its_generator_takes_and_what_is_expected() -> None:
    words = set(inspect.signature(write).parameters)
    for draw in draws():
        assert set(draw) - {"expects"} <= words
        assert draw["expects"] in ("right", "acceptable")


def test_recall_counts_a_set_only_at_the_true_joints_and_without_other_laws() -> None:
    hidden = [
        {"name": "backlash", "joints": ["a"], "any_joint": False, "names": ["backlash", "elasticity"]},
        {"name": "payload", "joints": ["b"], "any_joint": True},
    ]
    assert holds("elasticity(compliance)@a & payload(mass, distance)@a", hidden) == "true"
    assert holds("backlash(play)@b & payload(mass)@b", hidden) == ""
    assert holds("backlash(play)@a", hidden) == ""
    assert holds("backlash(play)@a & payload(mass)@b & cogging(7 values)@a", hidden) == "larger"
