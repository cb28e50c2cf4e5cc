"""The readable composition: TorchRL's SACLoss with imitation, one fused AdamW, soft target updates."""

import copy
from typing import Any

from tensordict import TensorDictBase
from tensordict.nn import TensorDictModule
from torch import Tensor
from torchrl.data import Bounded
from torchrl.envs.utils import ExplorationType, set_exploration_type
from torchrl.modules import ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import SACLoss, SoftUpdate

from tactile_cube.agent.networks import Actor, Sizes, build_networks
from tactile_cube.agent.optimizer import build_optimizer
from tactile_cube.agent.settings import AgentSettings
from tactile_cube.errors import InputError

CRITIC_KEYS = ["observation", "privileged", "action"]


def stochastic_actor(actor: Actor, action_size: int) -> ProbabilisticActor:
    """The actor as TorchRL's tanh-normal policy: reads "observation" only, writes "action"."""
    return ProbabilisticActor(
        module=TensorDictModule(actor, in_keys=["observation"], out_keys=["loc", "scale"]),
        in_keys=["loc", "scale"],
        spec=Bounded(-1.0, 1.0, (action_size,)),
        distribution_class=TanhNormal,
        return_log_prob=False,
    )


class ImitatingLoss(SACLoss):  # type: ignore[misc]
    """SACLoss whose actor also imitates demonstrated actions that the critics hold for better than its own.

    With weight w the actor minimises alpha log pi(a'|s) - Q(s, a') + w demonstrated [Q(s, a) > Q(s, a')] |m - a|^2:
    a' is drawn from the policy, m = tanh(mean) is its likeliest action, a the replayed one, Q the lower critic.

    Source: Nair et al. 2018, behaviour cloning with a Q filter.
    """

    demonstration_weight: float = 0.0

    def actor_loss(self, tensordict: TensorDictBase) -> tuple[Tensor, dict[str, Tensor]]:
        """The loss above, averaged over the batch; writes Q(s, a') to the key "value"."""
        with set_exploration_type(ExplorationType.RANDOM), self.actor_network_params.to_module(self.actor_network):
            policy = self.actor_network.get_dist(tensordict)
        own, replayed = policy.rsample(), tensordict["action"]
        log_prob, value = policy.log_prob(own), self.lower_value(tensordict, own)
        better = self.lower_value(tensordict, replayed) > value
        distance = (policy.deterministic_sample - replayed).square().sum(-1)
        imitation = self.demonstration_weight * tensordict["demonstrated"].squeeze(-1) * better * distance
        tensordict.set("value", value.detach())
        return (self._alpha * log_prob - value + imitation).mean(), {"log_prob": log_prob.detach()}

    def lower_value(self, tensordict: TensorDictBase, action: Tensor) -> Tensor:
        """The lower of both critics' values of an action (batch,), whose gradient is by the action alone."""
        judged = tensordict.select(*CRITIC_KEYS).set("action", action)
        values = self._vmap_qnetworkN0(judged, self._cached_detached_qvalue_params)["state_action_value"]
        lower: Tensor = values.min(0)[0].squeeze(-1)
        return lower


class Sac:
    """Soft actor-critic from TorchRL's parts."""

    def __init__(self, sizes: Sizes, **settings: Any):
        self.sizes = sizes
        self.settings = AgentSettings(**settings)
        if self.settings.precision != "fp32":
            raise InputError(
                f"agent.precision={self.settings.precision}: agent=sac knows fp32 only; use agent=sac_fast"
            )
        self.device = self.settings.torch_device()
        self.actor, *critics = build_networks(sizes, self.settings.hidden, self.settings.layer_norm)
        self.loss = self._build_loss(critics).to(self.device)
        self.targets = SoftUpdate(self.loss, tau=self.settings.tau)
        networks = [p for name, p in self.loss.named_parameters() if name != "log_alpha"]
        self.optimizer = build_optimizer(networks, self.loss.log_alpha, self.settings)

    def _build_loss(self, critics: list[Any]) -> ImitatingLoss:
        loss = ImitatingLoss(
            actor_network=stochastic_actor(self.actor, self.sizes.action),
            qvalue_network=[ValueOperator(critic, in_keys=CRITIC_KEYS) for critic in critics],
            loss_function="l2",
            alpha_init=self.settings.alpha_init,
            target_entropy=self.settings.target_entropy,
            deactivate_vmap=True,  # a plain loop over two critics is faster than vmap on a CPU
        )
        loss.demonstration_weight = self.settings.demonstration_weight
        loss.make_value_estimator(gamma=self.settings.gamma)
        return loss

    def losses(self, batch: TensorDictBase) -> TensorDictBase:
        """The loss of a batch: loss_qvalue, loss_actor, loss_alpha, alpha, entropy, value of the actor's actions."""
        data = batch.to(self.device)
        return self.loss(data).set("value", data["value"].mean())

    def update(self, batch: TensorDictBase) -> dict[str, Tensor]:
        """One step of critics, actor and temperature, then of the target critics."""
        losses = self.losses(batch)
        (losses["loss_qvalue"] + losses["loss_actor"] + losses["loss_alpha"]).backward()
        self.optimizer.step()
        self.optimizer.zero_grad()
        self.targets.step()
        return {
            "critic_loss": losses["loss_qvalue"].detach(),
            "actor_loss": -losses["alpha"] * losses["entropy"] - losses["value"],  # without imitation
            "alpha": losses["alpha"],
            "entropy": losses["entropy"],
            "value": losses["value"],
        }

    def policy(self) -> Actor:
        """A copy of the actor on the CPU, detached from the learner."""
        return copy.deepcopy(self.actor).cpu().requires_grad_(False)

    def state_dict(self) -> dict[str, Any]:
        """Networks, targets, temperature and optimiser."""
        return {"loss": self.loss.state_dict(), "optimizer": self.optimizer.state_dict()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Inverse of `state_dict`."""
        self.loss.load_state_dict(state["loss"])
        self.optimizer.load_state_dict(state["optimizer"])

    def load_networks(self, state: dict[str, Any]) -> None:
        """Warm start: networks and targets of a state, fresh optimiser and temperature."""
        kept = {name: value for name, value in state["loss"].items() if name != "log_alpha"}
        self.loss.load_state_dict(kept, strict=False)

    def load_actor(self, actor: Actor) -> None:
        """Warm start of the actor alone."""
        self.actor.load_state_dict(actor.state_dict())

    def approximations(self) -> list[str]:
        """None: float32 throughout."""
        return []
