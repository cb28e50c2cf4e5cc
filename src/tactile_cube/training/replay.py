"""A ring of transitions in one preallocated matrix: one row a transition, sampled by one gather."""

import os
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from tactile_cube.agent.batch import Batch, Sizes
from tactile_cube.errors import InputError


class Replay:
    """Uniform experience replay.

    Rewards are kept as unweighted terms and weighed at sampling, so that a schedule of the weights leaves no stale
    rewards.

    Args:
        capacity: transitions kept; the oldest are overwritten.
        sizes: widths of observation, privileged state and action.
        reward_terms: number of reward terms.
        seed: of the sampling generator.

    Raises:
        InputError: the machine has less memory than that takes.
    """

    def __init__(self, capacity: int, sizes: Sizes, reward_terms: int, seed: int):
        widths = {
            "observation": sizes.observation,
            "privileged": sizes.privileged,
            "action": sizes.action,
            "reward_terms": reward_terms,
            "next_observation": sizes.observation,
            "next_privileged": sizes.privileged,
            "terminated": 1,
            "steps": 1,
            "demonstrated": 1,
        }
        self.widths = widths
        self.capacity = capacity
        _require_memory(4 * capacity * sum(widths.values()), capacity)
        self.rows = torch.zeros(capacity, sum(widths.values()))
        self.written = 0
        self.generator = torch.Generator().manual_seed(seed)

    def __len__(self) -> int:
        """Transitions held now."""
        return min(self.written, self.capacity)

    def extend(self, transitions: Mapping[str, Tensor]) -> None:
        """Append transitions: tensors (rows, width) under the names of `widths`."""
        block = torch.cat([transitions[name].float() for name in self.widths], -1)[-self.capacity :]
        start = self.written % self.capacity
        first = min(len(block), self.capacity - start)
        self.rows[start : start + first] = block[:first]
        self.rows[: len(block) - first] = block[first:]
        # keeps `written % capacity` the next row to write even after a block larger than the ring
        self.written += len(block)

    def sample(self, size: int, weights: Tensor) -> Batch:
        """Draw `size` transitions with replacement; reward = reward_terms @ weights."""
        index = torch.randint(len(self), (size,), generator=self.generator)
        parts = dict(zip(self.widths, torch.split(self.rows[index], list(self.widths.values()), -1), strict=True))
        reward = (parts.pop("reward_terms") @ weights).unsqueeze(-1)
        return Batch(reward=reward, **parts)

    def state_dict(self) -> dict[str, Any]:
        """The filled part of the ring, where to write next, and the generator."""
        return {
            "rows": self.rows[: len(self)],
            "written": self.written,
            "capacity": self.capacity,
            "generator": self.generator.get_state(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Inverse of `state_dict`, for a ring of the same capacity and widths."""
        rows = state["rows"]
        if rows.shape[1] != self.rows.shape[1] or len(rows) != min(state["written"], self.capacity):
            raise InputError(
                f"replay in the checkpoint holds {len(rows)} rows of width {rows.shape[1]}, this run's up to "
                f"{self.capacity} of width {self.rows.shape[1]}; keep training.replay_size and the observation"
            )
        self.rows[: len(rows)] = rows
        self.written = state["written"]
        self.generator.set_state(state["generator"])


def _require_memory(size: int, capacity: int) -> None:
    """Refuse a replay larger than the machine's memory: it would be taken page by page, hours later."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else size
    if size > memory:
        raise InputError(
            f"training.replay_size={capacity}: takes {size / 2**30:.3g} GiB, this machine has {memory / 2**30:.3g}; "
            "keep fewer transitions"
        )
