"""The algorithm: soft actor-critic that collects one iteration ahead of learning.

In each iteration the workers collect a block with the actor as it is while the learner makes its updates on the replay
as it was one iteration before; so both overlap completely, and nothing depends on which of them is faster (paper,
section III). At barriers all worlds are reset from a seed that follows from the run's seed and the iteration. That is
the only place at which a run can be saved and resumed bit for bit, because the state of a simulator cannot be saved.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from tensordict import TensorDictBase
from torch import Tensor

from tactile_cube.agent.agent import Agent
from tactile_cube.env import Conditions
from tactile_cube.training.collection import Collection, CollectionError, Progress
from tactile_cube.training.replay import Replay
from tactile_cube.training.settings import TrainingSettings
from tactile_cube.training.transitions import EpisodeStatistics, TransitionAssembler


@dataclass
class Learner:
    """Agent, experience and counters: all that a run learns and remembers.

    Attributes:
        reward_weights: weights of the reward terms (terms,) under the conditions in force.
        conditions: those of the block begun last; None before the first.
    """

    agent: Agent
    replay: Replay
    collection: Collection
    episodes: EpisodeStatistics
    settings: TrainingSettings
    reward_weights: Callable[[Conditions], Tensor]
    seed: int
    iteration: int = 0
    steps: int = 0
    updates: int = 0
    conditions: Conditions | None = None
    metrics: dict[str, Tensor] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Start without a future to wait for."""
        self.assembler = TransitionAssembler(self.agent.settings.n_step, self.agent.settings.gamma)

    def run_to_barrier(self, after_iteration: Callable[[], None]) -> None:
        """Reset all worlds, then collect and learn up to the next barrier, which the end of the run is too."""
        self.collection.restart(barrier_seed(self.seed, self.iteration), self._progress())
        for _ in range(self.settings.barrier_iterations):
            self.iterate()
            after_iteration()
            if self.steps >= self.settings.steps:
                break
        self.replay.extend(self.assembler.flush())

    def iterate(self) -> None:
        """Collect a block and, meanwhile, learn from what was there before."""
        random = self.steps < self.settings.random_steps
        self.conditions = self.collection.launch(self.agent.policy(), random, self._progress())
        weights = self.reward_weights(self.conditions)
        if self.steps >= self.settings.learning_starts:
            actor = self.updates >= (self.settings.actor_frozen or 0)
            for _ in range(self.settings.updates_per_iteration):
                self.metrics = self.agent.update(self.replay.sample(self.agent.settings.batch_size, weights), actor)
            self.updates += self.settings.updates_per_iteration
        block = self.collection.take()
        self._require_finite(block)
        self.replay.extend(self.assembler.add(block))
        self.episodes.add(block, weights)
        self.steps += block.numel()
        self.iteration += 1

    @staticmethod
    def _require_finite(block: TensorDictBase) -> None:
        """Refuse what would poison replay and networks for good; steps marked as faulty never get there."""
        sound = ~block["next", "faulty"].squeeze(-1)
        for entries in (block, block["next"]):
            for key in ("observation", "privileged", "action", "reward_terms"):
                value = entries.get(key, None)
                if value is not None and not torch.isfinite(value[sound]).all():
                    raise CollectionError(f"simulation worker sent values of {key!r} that are not finite")

    def _progress(self) -> Progress:
        worlds = self.episodes.worlds
        return self.steps, self.episodes.mean_angle, *([worlds.odds] if worlds.ranges else [])

    def state_dict(self) -> dict[str, Any]:
        """Return everything that a resumed run needs; valid at barriers only."""
        return {
            "agent": self.agent.state_dict(),
            "replay": self.replay.state_dict(),
            "episodes": self.episodes.state_dict(),
            "counters": {"iteration": self.iteration, "steps": self.steps, "updates": self.updates},
            "random_state": torch.get_rng_state(),
            "cuda_random_state": torch.cuda.get_rng_state_all() if torch.cuda.is_available() else [],
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore what `state_dict` returned."""
        self.agent.load_state_dict(state["agent"])
        self.replay.load_state_dict(state["replay"])
        self.episodes.load_state_dict(state["episodes"])
        for name in ("iteration", "steps", "updates"):
            setattr(self, name, int(state["counters"][name]))
        torch.set_rng_state(state["random_state"])
        if torch.cuda.is_available() and state["cuda_random_state"]:
            torch.cuda.set_rng_state_all(state["cuda_random_state"])


def barrier_seed(seed: int, iteration: int) -> int:
    """Seed of the worlds from the barrier at `iteration` on, below 2^31."""
    return int(np.random.SeedSequence([seed, iteration]).generate_state(1)[0] >> 1)
