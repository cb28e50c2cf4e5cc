"""Experience replay: TorchRL's buffer over rows, one float32 row a transition, which is what a checkpoint appends."""

import logging
import os
from typing import Any

import torch
from tensordict import NestedKey, TensorDict, TensorDictBase
from torch import Tensor
from torchrl.data import LazyTensorStorage, ReplayBuffer

from tactile_cube.agent.networks import Sizes
from tactile_cube.errors import InputError

logging.getLogger("torchrl").setLevel(logging.WARNING)  # it announces each storage


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
        self.widths: dict[NestedKey, int] = {
            "observation": sizes.observation,
            "privileged": sizes.privileged,
            "action": sizes.action,
            ("next", "reward_terms"): reward_terms,
            ("next", "observation"): sizes.observation,
            ("next", "privileged"): sizes.privileged,
            ("next", "terminated"): 1,
            "steps_to_next_obs": 1,
            "demonstrated": 1,
        }
        self.capacity = capacity
        self.width = sum(self.widths.values())
        _require_memory(4 * capacity * self.width, capacity)
        self.generator = torch.Generator().manual_seed(seed)
        self.buffer = ReplayBuffer(storage=LazyTensorStorage(capacity), generator=self.generator)

    def __len__(self) -> int:
        """Transitions held now."""
        return len(self.buffer)

    @property
    def rows(self) -> Tensor:
        """The filled part of the ring, (len, width)."""
        return self.buffer[:] if len(self) else torch.zeros(0, self.width)

    def extend(self, transitions: TensorDictBase) -> None:
        """Append transitions (rows,) with the keys of `widths`."""
        if len(transitions):
            rows = torch.cat([transitions[key].float() for key in self.widths], -1)
            self.buffer.extend(rows[-self.capacity :])

    def sample(self, size: int, weights: Tensor) -> TensorDict:
        """Draw `size` transitions with replacement, as TorchRL's losses read them; reward = reward_terms @ weights."""
        rows = torch.split(self.buffer.sample(size), list(self.widths.values()), -1)
        parts = dict(zip(self.widths, rows, strict=True))
        parts["demonstrated"] = parts["demonstrated"].bool()
        parts["next", "reward"] = (parts.pop(("next", "reward_terms")) @ weights).unsqueeze(-1)
        # a time limit ends no episode for good: the value of its last state still counts
        parts["next", "done"] = parts["next", "terminated"] = parts["next", "terminated"].bool()
        return TensorDict(parts, [size])

    def state_dict(self) -> dict[str, Any]:
        """The filled part of the ring, where to write next, and the generator."""
        return {
            "rows": self.rows,
            "written": self.buffer.write_count,
            "capacity": self.capacity,
            "generator": self.generator.get_state(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Inverse of `state_dict`, for a ring of the same capacity and widths."""
        rows, width, written = state["rows"], self.width, state["written"]
        if rows.shape[1] != width or len(rows) != min(written, self.capacity):
            raise InputError(
                f"replay in the checkpoint holds {len(rows)} rows of width {rows.shape[1]}, this run's up to "
                f"{self.capacity} of width {width}; keep training.replay_size and the observation"
            )
        if len(rows):
            self.buffer.extend(rows)
        self.buffer.writer.load_state_dict({"_cursor": written % self.capacity, "_write_count": written})
        self.generator.set_state(state["generator"])


def _require_memory(size: int, capacity: int) -> None:
    """Refuse a replay larger than the machine's memory: it would be taken page by page, hours later."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else size
    if size > memory:
        raise InputError(
            f"training.replay_size={capacity}: takes {size / 2**30:.3g} GiB, this machine has {memory / 2**30:.3g}; "
            "keep fewer transitions"
        )
