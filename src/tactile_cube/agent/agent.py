"""Base class of the agents, soft actor-critic with any loss, and the hyperparameters."""

import copy
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Literal

import torch
from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, PositiveInt
from tensordict import TensorDictBase
from torch import Tensor, nn

from tactile_cube.agent.networks import Actor, Critic, Sizes, build_networks
from tactile_cube.agent.policy_file import DEEPEST, Width
from tactile_cube.errors import InputError


def multiplies_bfloat16() -> bool:
    """Return whether oneDNN has bfloat16 products for this CPU (AVX-512 and newer); they are slow elsewhere."""
    return bool(torch.ops.mkldnn._is_mkldnn_bf16_supported())


class AgentSettings(BaseModel):
    """Hyperparameters of SAC, the paper's where it states them; conf/agent/plain_sac.yaml explains each.

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
        """Return the device, if it is available.

        Raises:
            InputError: a GPU is asked for and torch finds none.
        """
        if self.device != "cpu" and not torch.cuda.is_available():
            raise InputError(f"agent.device={self.device}: torch finds no CUDA device here; use agent.device=cpu")
        return torch.device(self.device)

    @property
    def product_dtype(self) -> torch.dtype:
        """Data type of matrix products: float32 or bfloat16."""
        if self.precision == "auto":
            return torch.bfloat16 if self.device != "cpu" or multiplies_bfloat16() else torch.float32
        return torch.bfloat16 if self.precision == "bf16" else torch.float32

    def optimizer(self, networks: list[Tensor], log_alpha: Tensor) -> torch.optim.AdamW:
        """Make one fused AdamW for networks and temperature, without weight decay of the temperature."""
        rate = self.alpha_learning_rate or self.learning_rate
        groups: list[dict[str, Any]] = [
            {"params": networks},
            {"params": [log_alpha], "lr": rate, "weight_decay": 0.0},
        ]
        return torch.optim.AdamW(groups, lr=self.learning_rate, weight_decay=self.weight_decay, fused=True)


class Agent(ABC):
    """Actor, critics and temperature under one loss, with AdamW and soft target updates.

    Args:
        sizes: widths of the signals. Parameters are drawn from torch's global generator.
        critics: how many of them.
        quantiles: outputs of each critic, for losses that learn the distribution of the return.
        settings: see `AgentSettings`.

    Attributes:
        actor: the policy that learns; its parameters belong to `loss`.
        loss: all that is learned, the target critics and `log_alpha`.
    """

    def __init__(self, sizes: Sizes, critics: int = 2, quantiles: int = 1, **settings: Any):
        self.sizes, self.settings = sizes, AgentSettings(**settings)
        self.device = self.settings.torch_device()
        self.actor, networks = build_networks(sizes, self.settings.hidden, self.settings.layer_norm, critics, quantiles)
        self.loss = self.build_loss(networks)
        trained = {name: p for name, p in self.loss.named_parameters() if p.requires_grad}
        log_alpha = trained.pop("log_alpha")
        self.optimizer = self.settings.optimizer(list(trained.values()), log_alpha)

    @abstractmethod
    def build_loss(self, critics: list[Critic]) -> nn.Module:
        """Make `loss` on the device."""

    def losses(self, batch: TensorDictBase) -> Mapping[str, Tensor]:
        """Return loss_qvalue, loss_actor, loss_alpha, to be summed; alpha, entropy, value (mean Q of own actions)."""
        found: Mapping[str, Tensor] = self.loss(batch)
        return found

    @abstractmethod
    def follow(self) -> None:
        """Let the target critics follow the critics by `settings.tau`."""

    def update(self, batch: TensorDictBase, actor: bool = True) -> dict[str, Tensor]:
        """Take one gradient step of critics, actor and temperature, then update the target critics.

        Args:
            batch: replayed transitions (size,), as TorchRL's losses read them. The reward sums "steps_to_next_obs"
                discounted ones, "terminated" leaves out time limits, "demonstrated" marks demonstrations.
            actor: whether actor and temperature are updated too.

        Returns:
            Scalars on the agent's device: critic_loss, actor_loss (without imitation), alpha, entropy, value.
        """
        rough = self.settings.product_dtype == torch.bfloat16
        with torch.autocast(self.device.type, torch.bfloat16, enabled=rough):
            losses = self.losses(batch.to(self.device))
        total: Tensor = losses["loss_qvalue"] + losses["loss_actor"] + losses["loss_alpha"]
        torch.autograd.backward(total)
        for parameter in () if actor else (*self.actor.parameters(), self.loss.log_alpha):
            parameter.grad = None
        self.optimizer.step()
        self.optimizer.zero_grad()
        self.follow()
        alpha, entropy, value = losses["alpha"], losses["entropy"], losses["value"]
        return {
            "critic_loss": losses["loss_qvalue"].detach(),
            "actor_loss": -alpha * entropy - value,
            "alpha": alpha,
            "entropy": entropy,
            "value": value,
        }

    def policy(self) -> Actor:
        """Return a copy of the actor on the CPU, detached from the learner."""
        return copy.deepcopy(self.actor).cpu().requires_grad_(False)

    def state_dict(self) -> dict[str, Any]:
        """Return all state for a bit-for-bit resume: networks, targets, temperature, optimiser."""
        return {"loss": self.loss.state_dict(), "optimizer": self.optimizer.state_dict()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore what `state_dict` returned; a state of other shapes is refused."""
        self.loss.load_state_dict(state["loss"])
        self.optimizer.load_state_dict(state["optimizer"])

    def load_networks(self, state: dict[str, Any]) -> None:
        """Load networks and targets of a state; optimiser and temperature stay fresh (warm start)."""
        self.loss.load_state_dict(state["loss"] | {"log_alpha": self.loss.state_dict()["log_alpha"]})

    def load_actor(self, actor: Actor) -> None:
        """Load the actor alone, as from a policy file; critics stay fresh (warm start)."""
        self.actor.load_state_dict(actor.state_dict())

    def approximations(self) -> list[str]:
        """Return the deviations from exact float32 arithmetic, one sentence each, printed at the start of a run."""
        if self.settings.product_dtype != torch.bfloat16:
            return []
        asked = f"agent.precision={self.settings.precision}"
        fits = self.device.type != "cpu" or multiplies_bfloat16()
        slow = "" if fits else "; this processor is faster with agent.precision=fp32, which gives other bits"
        return [f"{asked}: matrix products in bfloat16, parameters and optimiser in float32{slow}"]
