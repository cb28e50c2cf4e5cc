"""Trials without exploration while a policy learns."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from PIL import Image

from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.env import Task
from tactile_cube.training.trial import ENGINES, SCORE, Trial
from tactile_cube.transforms import EnvConfig
from tests.training.tiny_env import tiny_environment
from tests.training.tiny_run import finish, tiny_run


def test_a_trial_tells_the_same_of_the_same_policy_films_it_and_leaves_the_generator_alone(tmp_path: Path) -> None:
    trial = Trial(EnvConfig(Task("full", episode_steps=4)))
    torch.manual_seed(0)
    actor = Actor(Sizes(120, 25, 12), (8,))
    before = torch.get_rng_state()
    first, second = (trial(actor, 1, tmp_path / "trial.gif") for _ in range(2))
    assert torch.equal(torch.get_rng_state(), before)
    assert first == second
    assert {name.partition("_")[0] for name in first} == {SCORE, *ENGINES}
    assert first["bullet_drift"] != first["mujoco_drift"]
    with Image.open(tmp_path / "trial.gif") as film:
        assert film.n_frames == 3


def test_the_policy_with_the_best_trial_is_kept_and_a_resumed_run_knows_it(tmp_path: Path) -> None:
    def environment(scores: list[float]) -> Any:
        return replace(tiny_environment(), trial=lambda actor, episodes, film: {SCORE: scores.pop(0)})

    settings = {"trial_every": 80, "trial_episodes": 1}
    finish(tiny_run(tmp_path, environment=environment([2.0]), steps=80, **settings))
    best = (tmp_path / "policy_best.safetensors").read_bytes()
    run = tiny_run(tmp_path, environment=environment([1.0]), **settings)
    weights = finish(run)
    assert (run.best_score, run.tried) == (2.0, {SCORE: 1.0})
    assert (tmp_path / "policy_best.safetensors").read_bytes() == best != (tmp_path / "policy.safetensors").read_bytes()
    assert torch.equal(weights, finish(tiny_run(tmp_path / "without", trial_every=0)))
    assert "trial_score" in (tmp_path / "metrics.csv").read_text().splitlines()[0]
