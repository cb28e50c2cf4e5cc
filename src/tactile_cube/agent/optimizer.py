"""One fused AdamW for networks and temperature."""

from typing import Any

import torch
from torch import Tensor

from tactile_cube.agent.settings import AgentSettings


def build_optimizer(networks: list[Tensor], log_alpha: Tensor, settings: AgentSettings) -> torch.optim.AdamW:
    """AdamW whose weight decay spares the temperature.

    Args:
        networks: parameters of actor and critics.
        log_alpha: logarithm of the temperature.
        settings: learning rates and weight decay.
    """
    groups: list[dict[str, Any]] = [
        {"params": networks},
        {"params": [log_alpha], "lr": settings.temperature_learning_rate, "weight_decay": 0.0},
    ]
    return torch.optim.AdamW(groups, lr=settings.learning_rate, weight_decay=settings.weight_decay, fused=True)
