"""Peer: Stable-Baselines3's SAC with the same networks, batch and schedule."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import gymnasium
import numpy as np

ROWS = 20_000


class Nothing(gymnasium.Env[Any, Any]):
    """Environment with spaces only."""

    def __init__(self, observation: int, action: int) -> None:
        """Takes the widths."""
        self.observation_space = gymnasium.spaces.Box(-1.0, 1.0, (observation,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (action,), np.float32)


def filled_sac(sb3: ModuleType, observation: int, action: int, hidden: int) -> Any:
    """SAC with a full replay of made-up transitions, ready for `train(gradient_steps, batch_size)`.

    Its critics see the observation alone, so its products are slightly smaller than ours.
    """
    model = sb3.SAC(
        "MlpPolicy",
        Nothing(observation, action),
        buffer_size=ROWS,
        batch_size=256,
        policy_kwargs={"net_arch": [hidden, hidden]},
        device="cpu",
        seed=0,
    )
    model.set_logger(sb3.common.logger.Logger(None, []))
    rng, replay = np.random.default_rng(0), model.replay_buffer
    for array in (replay.observations, replay.next_observations, replay.actions, replay.rewards):
        array[:] = rng.uniform(-1.0, 1.0, array.shape)
    replay.full = True
    return model


def learning_sac(sb3: ModuleType, make_env: Any, worlds: int, hidden: int, steps: int, updates: int) -> Any:
    """SAC on a vector of environments: `steps` steps in each, then `updates` updates, and so on."""
    vector = sb3.common.env_util.make_vec_env(make_env, n_envs=worlds, seed=0)
    return sb3.SAC(
        "MlpPolicy",
        vector,
        buffer_size=ROWS,
        batch_size=256,
        learning_starts=worlds,
        train_freq=(steps, "step"),
        gradient_steps=updates,
        policy_kwargs={"net_arch": [hidden, hidden]},
        device="cpu",
        seed=0,
    )
