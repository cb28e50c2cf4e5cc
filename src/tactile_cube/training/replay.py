"""Experience replay: TorchRL's buffer of transitions by key; a checkpoint appends them as float32 rows."""

import logging
import os
from collections.abc import Callable, Mapping
from typing import Any

import torch
from tensordict import NestedKey, TensorDict, TensorDictBase
from torch import Tensor
from torchrl.data import LazyTensorStorage, ReplayBuffer, TensorDictReplayBuffer

from tactile_cube.agent.networks import Sizes
from tactile_cube.errors import InputError

logging.getLogger("torchrl").setLevel(logging.WARNING)  # it announces each storage


FLAGS: tuple[NestedKey, ...] = (("next", "terminated"), "demonstrated")


class Rows:
    """The filled part of a ring as float32 rows (len, width), made where they are asked for."""

    def __init__(self, buffer: ReplayBuffer, widths: Mapping[NestedKey, int]):
        self._buffer, self._widths = buffer, widths
        self.shape = (len(buffer), sum(widths.values()))

    def __getitem__(self, index: Any) -> Tensor:
        """Some of them, keys side by side."""
        if not len(self._buffer):
            return torch.zeros(self.shape)
        chosen = self._buffer[index]
        return torch.cat([chosen[key].float() for key in self._widths], -1)


class Replay:
    """Experience replay.

    Rewards are kept as unweighted terms and weighed at sampling, so that a schedule of the weights leaves no stale
    rewards.

    Args:
        capacity: transitions kept; the oldest are overwritten.
        sizes: widths of observation, privileged state and action.
        reward_terms: number of reward terms.
        seed: of the sampling generator.
        make: makes the buffer from `storage` and `generator`.

    Raises:
        InputError: the machine has less memory than that takes.
    """

    def __init__(
        self,
        capacity: int,
        sizes: Sizes,
        reward_terms: int,
        seed: int,
        make: Callable[..., ReplayBuffer] = TensorDictReplayBuffer,
    ):
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
        self.buffer = make(storage=LazyTensorStorage(capacity), generator=self.generator)

    def __len__(self) -> int:
        """Transitions held now."""
        return len(self.buffer)

    @property
    def rows(self) -> Rows:
        """The filled part of the ring, (len, width)."""
        return Rows(self.buffer, self.widths)

    def extend(self, transitions: TensorDictBase) -> None:
        """Append transitions (rows,) with the keys of `widths`."""
        if len(transitions):
            kept = transitions[-self.capacity :]
            self._extend({key: kept[key] for key in self.widths})

    def _extend(self, parts: Mapping[NestedKey, Tensor]) -> None:
        kept = {key: part.bool() if key in FLAGS else part.float() for key, part in parts.items()}
        self.buffer.extend(TensorDict(kept, [len(kept["observation"])]))

    def sample(self, size: int, weights: Tensor) -> TensorDictBase:
        """Draw `size` transitions with replacement, as TorchRL's losses read them; reward = reward_terms @ weights."""
        batch: TensorDictBase = self.buffer.sample(size)
        following = batch["next"]
        following["reward"] = (following["reward_terms"] @ weights).unsqueeze(-1)
        following["done"] = following["terminated"]  # a time limit ends no episode for good: its last state counts
        return batch

    def state_dict(self) -> dict[str, Any]:
        """The filled part of the ring, where to write next, and the generator."""
        return {
            "rows": self.rows,
            "written": self.buffer.write_count,
            "capacity": self.capacity,
            "generator": self.generator.get_state(),
            "sampler": self.buffer.sampler.state_dict(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Inverse of `state_dict`, for a ring of the same capacity and widths."""
        rows, width, written = state["rows"], self.width, state["written"]
        if rows.shape[1] != width or rows.shape[0] != min(written, self.capacity):
            raise InputError(
                f"replay in the checkpoint holds {rows.shape[0]} rows of width {rows.shape[1]}, this run's up to "
                f"{self.capacity} of width {width}; keep training.replay_size and the observation"
            )
        if rows.shape[0]:
            parts = torch.split(rows[:], list(self.widths.values()), -1)
            self._extend(dict(zip(self.widths, parts, strict=True)))
        self.buffer.writer.load_state_dict({"_cursor": written % self.capacity, "_write_count": written})
        self.buffer.sampler.load_state_dict(state["sampler"])
        self.generator.set_state(state["generator"])


def _require_memory(size: int, capacity: int) -> None:
    """Refuse a replay larger than the machine's memory: it would be taken page by page, hours later."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else size
    if size > memory:
        raise InputError(
            f"training.replay_size={capacity}: takes {size / 2**30:.3g} GiB, this machine has {memory / 2**30:.3g}; "
            "keep fewer transitions"
        )
