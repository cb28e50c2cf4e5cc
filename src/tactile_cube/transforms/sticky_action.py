"""Actions that now and then do not arrive in time."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.envs.transforms import Transform

from tactile_cube.transforms.partial_reset import reset_mask


class StickyAction(Transform):  # type: ignore[misc]
    """With some probability a world repeats the action it executed last, whatever the policy says now.

    The first step of an episode is never sticky. The tensordict keeps the policy's action: repeating is the
    environment's noise. Draws from torch's global generator.

    Example:
        >>> env = TransformedEnv(worlds, StickyAction(0.1))
    """

    def __init__(self, probability: float) -> None:
        """Repeats with `probability` at each step, independently in each world."""
        super().__init__()
        self.probability = probability
        self._last: Tensor | None = None
        self._fresh: Tensor | None = None

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        mask = reset_mask(tensordict, tensordict_reset)
        self._fresh = mask if self._fresh is None else self._fresh | mask
        return tensordict_reset

    def _inv_call(self, tensordict: TensorDictBase) -> TensorDictBase:
        action = tensordict.get("action")
        if self._fresh is None or self._last is None:
            self._last = action
        stick = torch.rand((*action.shape[:-1], 1)) < self.probability
        if self._fresh is not None:
            stick &= ~self._fresh
        self._last = torch.where(stick, self._last, action)
        self._fresh = torch.zeros_like(stick)
        return tensordict.set("action", self._last)
