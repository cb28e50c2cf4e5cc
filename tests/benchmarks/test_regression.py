"""Recordings that a search may be changed by: none of them may judge it."""

import gzip
import inspect
import json
from pathlib import Path

from benchmarks.blind.generator import write
from benchmarks.regression.__main__ import draws
from benchmarks.regression.intervals import held
from benchmarks.regression.recall import holds

ROUNDS = Path(__file__).parents[2] / "docs" / "results" / "data" / "rounds"


DEVELOPMENT = range(1000)
"""Seeds that worlds are drawn with while they are written; no round begins among them."""


def test_every_seed_was_drawn_in_a_published_round_or_is_of_development() -> None:
    lines = [line for path in ROUNDS.glob("*.jsonl.gz") for line in gzip.decompress(path.read_bytes()).splitlines()]
    spent = {json.loads(line)["seed"] for line in lines}
    assert spent.isdisjoint(DEVELOPMENT)
    seeds = [draw["seed"] for draw in draws()]
    assert set(seeds) <= spent | set(DEVELOPMENT)
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


def test_an_interval_is_counted_where_generator_and_catalogue_mean_the_same_number() -> None:
    hidden = [
        {"name": "backlash", "joints": ["a"], "parameters": {"gap": 0.02, "width": 1.0}},
        {"name": "coupling_error", "joints": ["a"], "parameters": {"ratio": 0.75, "offset": 0.1}},
        {"name": "payload", "joints": ["b"], "parameters": {"mass": 1.0}},
    ]
    narrow = {"low": 0.0, "high": 0.01}
    named = [
        {"name": "backlash", "joints": ["a"], "parameters": {"gap": {"low": 0.01, "high": 0.03}}},
        {"name": "coupling_error", "joints": ["a"], "parameters": {"ratio": narrow, "offset": narrow}},
        {"name": "payload", "joints": ["a"], "parameters": {"mass": narrow}},
    ]
    found = dict(held({"truth": {"effects": hidden}, "diagnosis": {"effects": named}}))
    assert found == {"backlash.gap": True, "coupling_error.offset": False}
