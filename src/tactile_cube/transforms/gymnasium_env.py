"""The same environment, transforms included, for learners that speak Gymnasium."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict, TensorDictBase

from tactile_cube.env import OUTCOMES, REWARD_TERMS
from tactile_cube.transforms.make_env import EnvConfig, make_env

Observation = NDArray[np.float32]

FULL_TURN = 2.0 * np.pi
"""Bound of the readings: no joint of a hand turns that far [rad]."""


class GymnasiumRotation(gymnasium.Env[Observation, Observation]):
    """One world with stacked, noisy observations (120,) and actions (12,) in [-1, 1].

    `info` has "theta" [rad], "outcome", "faulty", "reward_terms" by name, and "privileged" (25,) for critics that may
    see the object. Random numbers come from a generator of its own: neither does it disturb torch's global one nor is
    it disturbed.

    Example:
        >>> env = gymnasium.make("tactile_cube/Rotation-v0", task="table", start="wide_yaw")
        >>> observation, info = env.reset(seed=0)
        >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - Gymnasium's own declaration

    def __init__(self, config: EnvConfig, render_mode: str | None = None) -> None:
        """Builds the world; `render_mode` is there because Gymnasium passes it, pictures come from `evaluate`."""
        self.render_mode = render_mode
        with torch.random.fork_rng(devices=[]):
            self._env = make_env(config, worlds=1, seed=0, evaluation=True)
            self._generator = torch.get_rng_state()
        shape = tuple(self._env.observation_spec["observation"].shape[1:])
        self.observation_space = gymnasium.spaces.Box(-FULL_TURN, FULL_TURN, shape, np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (12,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts the next episode; with a `seed`, the first of a new sequence."""
        super().reset(seed=seed)
        with self._own_generator():
            if seed is not None:
                self._env.set_seed(seed)
            data = self._env.reset()
        return data["observation"][0].numpy().copy(), _info(data)

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One policy step of 0.1 s."""
        command = torch.as_tensor(np.clip(action, -1.0, 1.0), dtype=torch.float32)[None]
        with self._own_generator():
            data = self._env.step(TensorDict({"action": command}, batch_size=[1]))["next"]
        ends = bool(data["terminated"]), bool(data["truncated"])
        return data["observation"][0].numpy().copy(), float(data["reward"]), *ends, _info(data)

    @contextmanager
    def _own_generator(self) -> Iterator[None]:
        with torch.random.fork_rng(devices=[]):
            torch.set_rng_state(self._generator)
            yield
            self._generator = torch.get_rng_state()

    def close(self) -> None:
        """Closes the world."""
        self._env.close()


def _info(data: TensorDictBase) -> dict[str, Any]:
    return {
        "theta": float(data["theta"]),
        "outcome": OUTCOMES[int(data["outcome"])],
        "faulty": bool(data["faulty"]),
        "reward_terms": dict(zip(REWARD_TERMS, data["reward_terms"][0].tolist(), strict=True)),
        "privileged": data["privileged"][0].numpy().copy(),
    }
