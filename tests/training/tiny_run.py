"""Runs small enough for tests."""

from pathlib import Path
from typing import Any

import torch

from tactile_cube.agent.plain_sac import PlainSac
from tactile_cube.training.build import Environment, build_run
from tactile_cube.training.run import Run
from tactile_cube.training.settings import CollectorSettings, TrainingSettings
from tests.training.tiny_env import tiny_environment

SCHEDULE: dict[str, Any] = {
    "steps": 160,
    "steps_per_iteration": 5,
    "updates_per_iteration": 3,
    "learning_starts": 20,
    "random_steps": 40,
    "replay_size": 120,
    "barrier_iterations": 4,
    "log_iterations": 1,
}


def tiny_run(
    folder: Path,
    seed: int = 0,
    collector: dict[str, Any] | None = None,
    environment: Environment | None = None,
    agent: Any = PlainSac,
    agent_settings: dict[str, Any] | None = None,
    **training: Any,
) -> Run:
    """A run of 160 steps in 4 worlds with networks of 16 units, ready to `train()`."""
    settings = {"hidden": (16, 16), "batch_size": 16, "learning_rate": 1e-2} | (agent_settings or {})
    return build_run(
        folder,
        seed,
        environment or tiny_environment(),
        lambda sizes: agent(sizes, **settings),
        CollectorSettings(**({"kind": "single", "worlds": 4, "processes": 1, "timeout": 30.0} | (collector or {}))),
        TrainingSettings(**(SCHEDULE | training)),
        {"seed": seed, "agent": {k: str(v) for k, v in settings.items()}, "training": SCHEDULE | training},
    )


def finish(run: Run) -> torch.Tensor:
    """Train to the end; all weights of the agent in one vector."""
    run.train()
    run.close()
    return weights(run)


def weights(run: Run) -> torch.Tensor:
    return torch.cat(
        [v.flatten().double() for v in run.learner.agent.state_dict()["loss"].values() if v.dtype.is_floating_point]
    )
