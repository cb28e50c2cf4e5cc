"""Every number of the learning algorithm, checked once."""

from typing import Any, Literal

import torch
from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, PositiveInt
from torch import Tensor

from tactile_cube.agent.policy_file import DEEPEST, Width
from tactile_cube.errors import InputError


def multiplies_bfloat16() -> bool:
    """Whether oneDNN has bfloat16 products for this CPU (AVX-512 and newer); they are slow elsewhere."""
    return bool(torch.ops.mkldnn._is_mkldnn_bf16_supported())


class AgentSettings(BaseModel):
    """Hyperparameters of SAC, as the paper publishes them where it does; conf/agent/plain_sac.yaml explains each.

    Imitation (`demonstration_weight`) is behaviour cloning with a Q filter, Nair et al. 2018. Collection stays on the
    CPU whatever the `device` ("cpu", "cuda" or "cuda:0"). Source: website table of the paper.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    hidden: tuple[Width, ...] = Field(default=(512, 512), min_length=1, max_length=DEEPEST)
    layer_norm: bool = False
    gamma: float = Field(default=0.9, gt=0.0, lt=1.0)
    learning_rate: PositiveFloat = 3e-4
    alpha_learning_rate: PositiveFloat | None = None
    weight_decay: float = Field(default=2.5e-4, ge=0.0)
    tau: float = Field(default=0.005, gt=0.0, le=1.0)
    alpha_init: PositiveFloat = 0.2
    target_entropy: float = -6.0
    n_step: PositiveInt = 1
    demonstration_weight: float = Field(default=0.0, ge=0.0)
    batch_size: PositiveInt = 256
    precision: Literal["fp32", "bf16", "auto"] = "fp32"
    device: str = Field(default="cpu", pattern=r"^(cpu|cuda(:\d+)?)$")

    def torch_device(self) -> torch.device:
        """The device, if it is there.

        Raises:
            InputError: a GPU is asked for and torch finds none.
        """
        if self.device != "cpu" and not torch.cuda.is_available():
            raise InputError(f"agent.device={self.device}: torch finds no CUDA device here; use agent.device=cpu")
        return torch.device(self.device)

    @property
    def product_dtype(self) -> torch.dtype:
        """What matrices are multiplied in: float32 or bfloat16."""
        if self.precision == "auto":
            return torch.bfloat16 if self.device != "cpu" or multiplies_bfloat16() else torch.float32
        return torch.bfloat16 if self.precision == "bf16" else torch.float32

    def optimizer(self, networks: list[Tensor], log_alpha: Tensor) -> torch.optim.AdamW:
        """One fused AdamW for networks and temperature, whose weight decay spares the temperature."""
        rate = self.alpha_learning_rate or self.learning_rate
        groups: list[dict[str, Any]] = [
            {"params": networks},
            {"params": [log_alpha], "lr": rate, "weight_decay": 0.0},
        ]
        return torch.optim.AdamW(groups, lr=self.learning_rate, weight_decay=self.weight_decay, fused=True)
