"""Trials without exploration while a policy learns."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.env import Task
from tactile_cube.training.trial import ENGINES, MEASURED, SCORE, Trial
from tactile_cube.transforms import EnvConfig
from tests.training.tiny_env import tiny_environment
from tests.training.tiny_run import finish, tiny_run


def test_a_trial_tells_the_same_of_the_same_policy_and_leaves_the_generator_alone() -> None:
    trial = Trial(EnvConfig(Task("full", episode_steps=12)))
    torch.manual_seed(0)
    actor = Actor(Sizes(120, 25, 12), (8,))
    before = torch.get_rng_state()
    first, second = trial(actor, 2), trial(actor, 2)
    assert torch.equal(torch.get_rng_state(), before)
    assert first == second
    assert first.keys() == {SCORE, *(f"{engine}_{name}" for engine in ENGINES for name in MEASURED)}
    assert first["bullet_drift"] != first["mujoco_drift"]
    assert first[SCORE] == pytest.approx(
        sum(first[f"{engine}_angle"] for engine in ENGINES if first[f"{engine}_held"] == 1.0) / 2, abs=0.2
    )


def test_the_policy_with_the_best_trial_is_kept_and_a_resumed_run_knows_it(tmp_path: Path) -> None:
    def environment(scores: list[float]) -> Any:
        return replace(tiny_environment(), trial=lambda actor, episodes: {SCORE: scores.pop(0)})

    settings = {"trial_every": 80, "trial_episodes": 1}
    finish(tiny_run(tmp_path, environment=environment([2.0]), steps=80, **settings))
    best = (tmp_path / "policy_best.safetensors").read_bytes()
    run = tiny_run(tmp_path, environment=environment([1.0]), **settings)
    weights = finish(run)
    assert (run.best_score, run.tried) == (2.0, {SCORE: 1.0})
    assert (tmp_path / "policy_best.safetensors").read_bytes() == best != (tmp_path / "policy.safetensors").read_bytes()
    assert torch.equal(weights, finish(tiny_run(tmp_path / "without", trial_every=0)))
    assert "trial_score" in (tmp_path / "metrics.csv").read_text().splitlines()[0]
