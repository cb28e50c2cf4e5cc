"""The readable composition: a loss of TorchRL, its SACLoss with imitation or another, AdamW and soft target updates."""

import copy
from collections.abc import Callable
from functools import partial
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModule
from torch import Tensor
from torchrl.data import Bounded
from torchrl.envs.utils import ExplorationType, set_exploration_type
from torchrl.modules import ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import LossModule, SACLoss, SoftUpdate

from tactile_cube.agent.networks import Actor, Critic, Sizes, build_networks
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
        tensordict.set("value", value.detach())
        loss = self._alpha * log_prob - value
        if self.demonstration_weight:
            better = self.lower_value(tensordict, replayed) > value
            distance = (policy.deterministic_sample - replayed).square().sum(-1)
            loss += self.demonstration_weight * tensordict["demonstrated"].squeeze(-1) * better * distance
        return loss.mean(), {"log_prob": log_prob.detach()}

    def lower_value(self, tensordict: TensorDictBase, action: Tensor) -> Tensor:
        """The lower of both critics' values of an action (batch,), whose gradient is by the action alone."""
        judged = tensordict.select(*CRITIC_KEYS).set("action", action)
        values = self._vmap_qnetworkN0(judged, self._cached_detached_qvalue_params)["state_action_value"]
        lower: Tensor = values.min(0)[0].squeeze(-1)
        return lower


class Sac:
    """Soft actor-critic from TorchRL's parts.

    Args:
        sizes: widths of the signals.
        loss: makes a loss of TorchRL from a stochastic `actor_network` and a list `qvalue_network`.
        critics: how many of them.
        quantiles: outputs of each critic, for losses that learn the distribution of the return.
        settings: see `AgentSettings`.

    Raises:
        InputError: a loss that takes other networks, or cannot imitate and shall.
    """

    def __init__(
        self,
        sizes: Sizes,
        loss: Callable[..., LossModule] = partial(ImitatingLoss, loss_function="l2"),  # noqa: B008
        critics: int = 2,
        quantiles: int = 1,
        **settings: Any,
    ):
        self.sizes = sizes
        self.settings = AgentSettings(**settings)
        self.device = self.settings.torch_device()
        self.actor, networks = build_networks(sizes, self.settings.hidden, self.settings.layer_norm, critics, quantiles)
        try:
            self.loss = self._build_loss(loss, networks).to(self.device)
            self.targets = SoftUpdate(self.loss, tau=self.settings.tau)
            self._try_losses()
        except (TypeError, RuntimeError, LookupError, AttributeError) as error:
            raise InputError(
                f"agent.loss: {error}; give SACLoss, TQCLoss or a class derived from one, as conf/agent/tqc.yaml does"
            ) from error
        parameters = [p for name, p in self.loss.named_parameters() if name != "log_alpha"]
        self.optimizer = self.settings.optimizer(parameters, self.loss.log_alpha)

    def _build_loss(self, make: Callable[..., LossModule], critics: list[Critic]) -> LossModule:
        loss = make(
            actor_network=stochastic_actor(self.actor, self.sizes.action),
            qvalue_network=[ValueOperator(critic, in_keys=CRITIC_KEYS) for critic in critics],
            num_qvalue_nets=len(critics),
            alpha_init=self.settings.alpha_init,
            target_entropy=self.settings.target_entropy,
            deactivate_vmap=True,  # a plain loop over critics is faster than vmap on a CPU
        )
        if isinstance(loss, ImitatingLoss):
            loss.demonstration_weight = self.settings.demonstration_weight
        elif self.settings.demonstration_weight:
            raise InputError(
                f"agent.demonstration_weight={self.settings.demonstration_weight:g}: {type(loss).__name__} does not "
                "imitate; set it to 0"
            )
        loss.make_value_estimator(gamma=self.settings.gamma)
        return loss

    def _try_losses(self) -> None:
        """Ask for what an update needs of a made-up batch: a loss that does not fit is told before any episode."""
        sizes, one, no = self.sizes, torch.ones(2, 1), torch.zeros(2, 1, dtype=torch.bool)
        state = {"observation": torch.zeros(2, sizes.observation), "privileged": torch.zeros(2, sizes.privileged)}
        chosen = {"action": torch.zeros(2, sizes.action), "demonstrated": no, "steps_to_next_obs": one}
        following = state | {"reward": one, "done": no, "terminated": no}
        with torch.random.fork_rng():  # training draws what it drew without this
            losses = self.losses(TensorDict(state | chosen | {"next": following}, [2]))
        losses.select("loss_qvalue", "loss_actor", "loss_alpha", "alpha")

    def losses(self, batch: TensorDictBase) -> TensorDictBase:
        """The loss of a batch: loss_qvalue, loss_actor, loss_alpha, alpha, entropy, value of the actor's actions."""
        data, rough = batch.to(self.device), self.settings.product_dtype == torch.bfloat16
        with torch.autocast(self.device.type, torch.bfloat16, enabled=rough):
            losses: TensorDictBase = self.loss(data)
        value = data.get("value", -losses["alpha"] * losses["entropy"] - losses["loss_actor"])
        return losses.set("value", value.detach().mean())

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
        """What departs from exact float32."""
        rough = self.settings.product_dtype == torch.bfloat16
        return [f"agent.precision={self.settings.precision}: autocast to bfloat16"] if rough else []
