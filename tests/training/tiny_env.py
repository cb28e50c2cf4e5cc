"""A world of a few numbers with the keys of the real one: turning is a matter of pushing all joints up."""

from functools import partial
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Bounded, Categorical, Composite, Unbounded
from torchrl.envs import EnvBase, TransformedEnv
from torchrl.envs.transforms import Compose

from tactile_cube.agent.networks import Sizes
from tactile_cube.env import Conditions
from tactile_cube.training.build import Environment
from tactile_cube.transforms import Curriculum, Ramps

SIZES = Sizes(observation=6, privileged=3, action=2)
TERMS = ("push", "lost")
LENGTH = 7


class TinyEnv(EnvBase):
    """Batch of `worlds`; episodes end by time after LENGTH steps, or for good when theta passes -0.5."""

    def __init__(self, worlds: int, seed: int, fail_at: int | None = None, fault: float = 0.0):
        super().__init__(device="cpu", batch_size=[worlds])
        n = worlds
        flag = Categorical(2, shape=(n, 1), dtype=torch.bool)
        self.observation_spec = Composite(
            observation=Unbounded((n, SIZES.observation)),
            privileged=Unbounded((n, SIZES.privileged)),
            theta=Unbounded((n, 1)),
            episode_step=Unbounded((n, 1), dtype=torch.int64),
            exploring=flag.clone(),
            faulty=flag.clone(),
            reward_terms=Unbounded((n, len(TERMS))),
            shape=(n,),
        )
        self.action_spec = Bounded(-1.0, 1.0, (n, SIZES.action))
        self.reward_spec = Unbounded((n, 1))
        self.done_spec = Composite(done=flag, terminated=flag.clone(), truncated=flag.clone(), shape=(n,))
        self._fail_at, self._fault, self._calls = fail_at, fault, 0
        self._theta = torch.zeros(n, 1)
        self._count = torch.zeros(n, 1, dtype=torch.int64)
        self.conditions = self.final_conditions = Conditions(filter_time=0.12, gravity_scale=1e6 + 1, penalty_scale=1.0)
        self.set_seed(seed)

    def _set_seed(self, seed: int | None) -> None:
        torch.manual_seed(seed or 0)

    def _observe(self) -> dict[str, torch.Tensor]:
        n = self.batch_size[0]
        noise = 0.1 * torch.randn(n, SIZES.observation)
        return {
            "observation": noise + self._theta,
            "privileged": self._theta.expand(n, SIZES.privileged).clone(),
            "theta": self._theta.clone(),
            "episode_step": self._count.clone(),
            "exploring": torch.zeros(n, 1, dtype=torch.bool),
        }

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        mask = torch.ones_like(self._count, dtype=torch.bool)
        if tensordict is not None and "_reset" in tensordict:
            mask = tensordict["_reset"].reshape(mask.shape)
        fresh = self.conditions.gravity_scale * 0.1 * torch.randn_like(self._theta)
        self._theta = torch.where(mask, fresh, self._theta)
        self._count = torch.where(mask, 0, self._count)
        nothing = {"faulty": torch.zeros_like(mask), "reward_terms": torch.zeros(*mask.shape[:1], len(TERMS))}
        return TensorDict(self._observe() | nothing, batch_size=self.batch_size)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        self._calls += 1
        if self._fail_at is not None and self._calls >= self._fail_at:
            raise ValueError("tiny world broke")
        push = tensordict["action"].mean(-1, keepdim=True)
        self._theta = self._theta + 0.3 * push
        self._count = self._count + 1
        faulty = torch.rand_like(self._theta) < self._fault
        terminated = (self._theta < -0.5) | faulty
        truncated = (self._count >= LENGTH) & ~terminated
        terms = torch.cat((push, -terminated.float()), -1)
        terms = torch.where(faulty, torch.nan, terms)
        data = self._observe() | {
            "faulty": faulty,
            "reward_terms": terms,
            "reward": terms.sum(-1, keepdim=True),
            "terminated": terminated,
            "truncated": truncated,
            "done": terminated | truncated,
        }
        return TensorDict(data, batch_size=self.batch_size)


def tiny_weights(conditions: Conditions) -> torch.Tensor:
    return torch.tensor([1.0, 0.5])


def tiny_world(worlds: int, seed: int, kind: type[TinyEnv] = TinyEnv, **options: Any) -> TransformedEnv:
    """Starts that scatter more and more: by 0.1 at first, by 0.1 more every 1000 steps."""
    ramps = Ramps(low=0, high=1e9, filter_time=None, gravity_scale=1.0)
    return TransformedEnv(kind(worlds, seed, **options), Compose(Curriculum(ramps)))


def tiny_environment(**options: Any) -> Environment:
    return Environment(partial(tiny_world, **options), SIZES, TERMS, tiny_weights)
