"""Many worlds in one process as one TorchRL environment."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Bounded, Categorical, Composite, Unbounded
from torchrl.envs import EnvBase

from tactile_cube.env.rotation import OBJECT, RotationEnv, TimeStep
from tactile_cube.env.task import FAULTY, OUTCOMES


class WorldsEnv(EnvBase):  # type: ignore[misc]
    """Rotation tasks side by side, batch size `[worlds]`.

    Keys are those of TimeStep, besides "episode_step", "faulty", "action" (joints), "done", "terminated", "truncated",
    and where constants are steered "places", see RotationEnv. Transitions whose "faulty" is true come from broken
    physics and must not be learned from.

    Attributes:
        conditions: of the episodes that start from now on.
        odds: probabilities of the parts of the steered constants' ranges, in the episodes that start from now on.

    Example:
        >>> env = WorldsEnv([RotationEnv(...), RotationEnv(...)])
        >>> env.rollout(100)["next", "theta"].shape
        torch.Size([2, 100, 1])
    """

    def __init__(self, tasks: Sequence[RotationEnv]) -> None:
        """Host `tasks`."""
        super().__init__(device="cpu", batch_size=[len(tasks)])
        self.tasks = list(tasks)
        self.conditions, self.odds = self.tasks[0].conditions, self.tasks[0].odds
        self.final_conditions = self.tasks[0].task.conditions()
        self._time_steps: list[TimeStep] = []
        self._make_specs()
        self._seed_tasks(0)

    def _make_specs(self) -> None:
        n, first = len(self.tasks), self.tasks[0]
        joints = first.hand.joints
        sizes = {"joint_position": joints, "control_error": joints, "object_state": OBJECT + joints, "theta": 1}
        sizes["reward_terms"] = len(first.reward.terms)
        if first.steered:
            sizes["places"] = len(first.steered)
        spec = Composite({key: Unbounded((n, size)) for key, size in sizes.items()}, shape=(n,))
        spec["episode_step"] = Unbounded((n, 1), dtype=torch.int64)
        spec["outcome"] = Categorical(len(OUTCOMES), shape=(n, 1), dtype=torch.int64)
        spec["faulty"] = Categorical(2, shape=(n, 1), dtype=torch.bool)
        self.observation_spec = spec
        self.action_spec = Bounded(-1.0, 1.0, (n, joints))
        self.reward_spec = Unbounded((n, 1))
        flag = Categorical(2, shape=(n, 1), dtype=torch.bool)
        self.done_spec = Composite(done=flag, terminated=flag.clone(), truncated=flag.clone(), shape=(n,))

    def _set_seed(self, seed: int | None) -> None:
        """Seed every world, and the generator that the transforms draw from."""
        if seed is not None:
            torch.default_generator.manual_seed(seed)
            self._seed_tasks(seed)

    def _seed_tasks(self, seed: int) -> None:
        for index, task in enumerate(self.tasks):
            task.seed(seed, index)

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        mask = None if tensordict is None else tensordict.get("_reset", None)
        for task in self.tasks:
            task.conditions, task.odds = self.conditions, self.odds
        chosen = [True] * len(self.tasks) if mask is None or not self._time_steps else mask.flatten().tolist()
        self._time_steps = [
            task.reset() if start else self._time_steps[i]
            for i, (task, start) in enumerate(zip(self.tasks, chosen, strict=True))
        ]
        return self._batch(with_reward=False)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        actions = tensordict.get("action").numpy()
        self._time_steps = [task.step(action) for task, action in zip(self.tasks, actions, strict=True)]
        return self._batch(with_reward=True)

    def _batch(self, with_reward: bool) -> TensorDictBase:
        moments = self._time_steps
        whole = ("joint_position", "control_error", "object_state", "reward_terms")
        data: dict[str, torch.Tensor] = {key: _rows([getattr(m, key) for m in moments]) for key in whole}
        data |= {
            "theta": _rows([[m.theta] for m in moments]),
            "episode_step": torch.tensor([[m.step] for m in moments]),
            "outcome": torch.tensor([[m.outcome] for m in moments]),
            "faulty": torch.tensor([[m.outcome == FAULTY] for m in moments]),
            "terminated": torch.tensor([[m.terminated] for m in moments]),
            "truncated": torch.tensor([[m.truncated] for m in moments]),
        }
        if self.tasks[0].steered:
            data["places"] = _rows([task.places for task in self.tasks])
        data["done"] = data["terminated"] | data["truncated"]
        if with_reward:
            data["reward"] = _rows([[m.reward] for m in moments])
        return TensorDict(data, batch_size=self.batch_size)


def _rows(rows: Sequence[Any]) -> torch.Tensor:
    return torch.from_numpy(np.array(rows, dtype=np.float32))
