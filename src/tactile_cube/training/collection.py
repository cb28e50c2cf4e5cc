"""Collect experience: in this process, or in workers while the learner works.

Both give the same numbers for the same seed and division of worlds: everything random in a worker comes from torch's
generator and the worlds' own, and `restart` sets both.
"""

import copy
import time
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torchrl.collectors import Collector
from torchrl.envs import EnvBase

from tactile_cube.agent.networks import Actor
from tactile_cube.env import Conditions

MakeEnv = Callable[..., EnvBase]
"""make_env(worlds=n, seed=s) -> batched environment of n worlds with a method set_progress(steps, performance)."""

Progress = tuple[Any, ...]
"""What a curriculum goes by: environment steps so far, and mean final angle [rad] of the last episodes; where constants
are steered also the odds of their parts."""


class CollectionError(RuntimeError):
    """A simulation worker died, got stuck or failed; the run can go on from its last checkpoint."""


class Collection(Protocol):
    """A source of blocks of experience (worlds, steps)."""

    def restart(self, seed: int, progress: Progress) -> None:
        """Reset all worlds and seed everything random in them."""

    def launch(self, actor: Actor, random: bool, progress: Progress) -> Conditions:
        """Begin collecting one block with these weights; gives the conditions in force."""

    def take(self) -> TensorDictBase:
        """Wait for the block begun last; it is the caller's to keep."""

    def cpu_seconds(self) -> float:
        """CPU time spent simulating so far [s]."""

    def close(self) -> None:
        """End the workers."""


class Behaviour(TensorDictModuleBase):  # type: ignore[misc]
    """Policy of the collectors: reads "observation", writes "action".

    Whether actions are random travels with the weights as a buffer, so that it reaches every worker in the same
    iteration and survives a resume. Noise comes from torch's global generator of the worker.

    Args:
        actor: its own copy, never the learner's.
    """

    in_keys = ["observation"]  # noqa: RUF012 - the name and type TorchRL asks for
    out_keys = ["action"]  # noqa: RUF012

    def __init__(self, actor: Actor):
        super().__init__()
        self.actor = actor.requires_grad_(False)
        self.register_buffer("random", torch.zeros(()))

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Sample an action for each world."""
        mean, scale = self.actor(tensordict["observation"])
        action = torch.tanh(mean + scale * torch.randn_like(mean))
        if self.random:
            action = torch.rand_like(action) * 2.0 - 1.0
        return tensordict.set("action", action)


class SingleCollection:
    """All worlds in this process, stepped before the learner's updates: nothing overlaps, everything is in reach.

    Args:
        make_env: see `MakeEnv`.
        actor: any actor of the right sizes.
        worlds: number of worlds.
        steps: environment steps a world and block.
    """

    def __init__(self, make_env: MakeEnv, actor: Actor, worlds: int, steps: int):
        self._behaviour = Behaviour(copy.deepcopy(actor))
        with torch.random.fork_rng(devices=[]):  # worlds seed torch's generator, which here is the learner's too
            self._env = make_env(worlds=worlds, seed=0)
            self._collector = Collector(
                self._env,
                self._behaviour,
                frames_per_batch=worlds * steps,
                total_frames=-1,
                trust_policy=True,
                auto_register_policy_transforms=False,
            )
            self._random_state = torch.get_rng_state()
        self._blocks = iter(self._collector)
        self._block: TensorDictBase | None = None
        self._cpu = 0.0

    def restart(self, seed: int, progress: Progress) -> None:
        """Reset all worlds and seed everything random in them."""
        self._env.set_progress(*progress)
        self._aside(partial(self._seed_and_reset, seed))

    def launch(self, actor: Actor, random: bool, progress: Progress) -> Conditions:
        """Collect one block."""
        conditions: Conditions = self._env.set_progress(*progress)
        self._behaviour.actor.load_state_dict(actor.state_dict())
        self._behaviour.random.fill_(float(random))
        self._block = self._aside(lambda: next(self._blocks).clone())
        return conditions

    def take(self) -> TensorDictBase:
        """The block collected last."""
        assert self._block is not None, "launch first"
        return self._block

    def cpu_seconds(self) -> float:
        """CPU time spent simulating so far [s]."""
        return self._cpu

    def close(self) -> None:
        """Close the worlds."""
        self._collector.shutdown()

    def _seed_and_reset(self, seed: int) -> None:
        self._collector.set_seed(seed)
        torch.manual_seed(seed)
        self._collector.reset()

    def _aside(self, call: Callable[[], Any]) -> Any:
        """Run a call on the collection's own random state, as if it were another process."""
        learner_state, started = torch.get_rng_state(), time.thread_time()
        torch.set_rng_state(self._random_state)
        try:
            return call()
        finally:
            self._random_state = torch.get_rng_state()
            torch.set_rng_state(learner_state)
            self._cpu += time.thread_time() - started
