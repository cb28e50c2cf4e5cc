"""Experience replay: TorchRL's buffer of transitions by key."""

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


class Replay:
    """Experience replay.

    Rewards are kept as unweighted terms and weighted at sampling, so that a schedule of the weights leaves no stale
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
        size = 4 * capacity * sum(self.widths.values())
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else size
        if size > memory:  # it would run out only hours later, as pages are first used
            raise InputError(
                f"training.replay_size={capacity}: takes {size / 2**30:.3g} GiB, this machine has "
                f"{memory / 2**30:.3g}; keep fewer transitions"
            )
        self.generator = torch.Generator().manual_seed(seed)
        self.buffer = make(storage=LazyTensorStorage(capacity), generator=self.generator)

    def __len__(self) -> int:
        """Return the transitions held now."""
        return len(self.buffer)

    def extend(self, transitions: Mapping[NestedKey, Tensor] | TensorDictBase) -> None:
        """Append transitions (rows,) with the keys of `widths`."""
        count = min(len(transitions["observation"]), self.capacity)
        if count:
            kept = {key: transitions[key][-count:] for key in self.widths}
            typed = {key: part.bool() if key in FLAGS else part.float() for key, part in kept.items()}
            self.buffer.extend(TensorDict(typed, [count]))

    def sample(self, size: int, weights: Tensor) -> TensorDictBase:
        """Draw `size` transitions with replacement, as TorchRL's losses read them; reward = reward_terms @ weights."""
        batch: TensorDictBase = self.buffer.sample(size)
        following = batch["next"]
        following["reward"] = (following["reward_terms"] @ weights).unsqueeze(-1)
        following["done"] = following["terminated"]  # a time limit ends no episode for good: its last state counts
        return batch

    def state_dict(self) -> dict[str, Any]:
        """Return the transitions by key in the order of the ring, the write position, and the generator."""
        held = self.buffer[:] if len(self) else {key: torch.zeros(0, width) for key, width in self.widths.items()}
        return {
            "transitions": [held[key].clone() for key in self.widths],
            "written": self.buffer.write_count,
            "capacity": self.capacity,
            "generator": self.generator.get_state(),
            "sampler": self.buffer.sampler.state_dict(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore what `state_dict` returned, for a ring of the same capacity and widths."""
        written, parts = state["written"], state["transitions"]
        wanted = [(min(written, self.capacity), width) for width in self.widths.values()]
        if (found := [tuple(part.shape) for part in parts]) != wanted:
            raise InputError(
                f"replay in the checkpoint holds parts of the shapes {found}, this run's up to {self.capacity} "
                f"transitions with {list(self.widths.values())} numbers; keep training.replay_size and the observation"
            )
        self.extend(dict(zip(self.widths, parts, strict=True)))
        self.buffer.writer.load_state_dict({"_cursor": written % self.capacity, "_write_count": written})
        self.buffer.sampler.load_state_dict(state["sampler"])
        self.generator.set_state(state["generator"])
