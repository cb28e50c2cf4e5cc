"""What one update learns from, and how large its parts are."""

from dataclasses import dataclass, fields
from typing import Self

import torch
from torch import Tensor


@dataclass(frozen=True)
class Sizes:
    """Widths of the signals: observation (actor), privileged (critics only), action."""

    observation: int
    privileged: int
    action: int

    @property
    def critic(self) -> int:
        """Width of a critic's input: observation, privileged state and action side by side."""
        return self.observation + self.privileged + self.action


@dataclass(frozen=True, slots=True)
class Batch:
    """Replayed transitions, all float32 of shape (batch, width).

    `reward` sums `steps` discounted rewards, after which `next_observation` was reached. `terminated` is 1 where the
    episode ended for good; a time limit is no such end, so there the value of the last state still counts.
    `demonstrated` is 1 where a hand-crafted gait chose the action.
    """

    observation: Tensor
    privileged: Tensor
    action: Tensor
    reward: Tensor
    next_observation: Tensor
    next_privileged: Tensor
    terminated: Tensor
    steps: Tensor
    demonstrated: Tensor

    def to(self, device: torch.device) -> Self:
        """The same batch on another device."""
        if self.observation.device == device:
            return self
        moved = (getattr(self, field.name).to(device, non_blocking=True) for field in fields(self))
        return type(self)(*moved)
