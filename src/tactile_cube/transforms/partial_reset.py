"""Which worlds of a batch a reset is for."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from torch import Tensor


def reset_mask(tensordict: TensorDictBase, fresh: TensorDictBase) -> Tensor:
    """Worlds that start an episode now, `(*batch, 1)` bool: those of "_reset", or all where it is missing.

    Args:
        tensordict: what reset was called with.
        fresh: what the environment gave back.
    """
    mask: Tensor | None = tensordict.get("_reset", None)
    if mask is None:
        return torch.ones((*fresh.batch_size, 1), dtype=torch.bool)
    return mask.reshape(*fresh.batch_size, 1)
