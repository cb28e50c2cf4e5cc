"""Soft actor-critic in plain autograd: the loss on one page."""

import torch
from tensordict import TensorDictBase
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from tactile_cube.agent.agent import Agent, AgentSettings
from tactile_cube.agent.networks import Actor, Critic, lowest


class PlainLoss(nn.Module):
    """Losses of twin critics, actor and temperature.

    Source: Haarnoja et al. 2018, *Soft Actor-Critic Algorithms and Applications*. With weight w the actor minimises
    alpha log pi(a'|s) - Q(s, a') + w demonstrated [Q(s, a) > Q(s, a')] |m - a|^2: a' is drawn from the policy,
    m = tanh(mean) is its likeliest action, a the replayed one, Q the lower critic. Source: Nair et al. 2018, behaviour
    cloning with a Q filter.
    """

    def __init__(self, actor: Actor, critics: list[Critic], settings: AgentSettings):
        super().__init__()
        self.actor, self.critics, self.settings = actor, nn.ModuleList(critics), settings
        average = get_ema_multi_avg_fn(1.0 - settings.tau)  # type: ignore[no-untyped-call]
        self.targets = AveragedModel(self.critics, multi_avg_fn=average)
        self.targets.requires_grad_(False)
        self.follow()  # the first call copies
        self.log_alpha = nn.Parameter(torch.tensor(settings.alpha_init).log())

    def forward(self, batch: TensorDictBase) -> dict[str, Tensor]:
        """Return the losses whose sum is to be differentiated, and what the log shows."""
        state, following = (batch["observation"], batch["privileged"]), batch["next"]
        alpha = self.log_alpha.detach().exp()
        with torch.no_grad():
            after = self.actor.sample(following["observation"])
            future = lowest(
                self.targets.module.children(), following["observation"], following["privileged"], after.action
            )
            discount = self.settings.gamma ** batch["steps_to_next_obs"] * ~following["terminated"]
            target = following["reward"] + discount * (future - alpha * after.log_prob)
        own = self.actor.sample(batch["observation"])
        replayed = [critic(*state, batch["action"]).float() for critic in self.critics]
        self.critics.requires_grad_(False)  # the actor's loss trains the actor
        value = lowest(self.critics, *state, own.action)
        self.critics.requires_grad_(True)
        actor_loss = (alpha * own.log_prob - value).mean()
        if self.settings.demonstration_weight:
            better = batch["demonstrated"] * (torch.stack(replayed).detach().amin(0) > value.detach())
            distance = (own.likeliest - batch["action"]).square().sum(-1, keepdim=True)
            actor_loss = actor_loss + self.settings.demonstration_weight * (better * distance).mean()
        entropy = -own.log_prob.detach().mean()
        return {
            "loss_qvalue": torch.stack([(q - target).square().mean() for q in replayed]).sum(),
            "loss_actor": actor_loss,
            "loss_alpha": self.log_alpha * (entropy - self.settings.target_entropy),
            "alpha": alpha,
            "entropy": entropy,
            "value": value.detach().mean(),
        }

    def follow(self) -> None:
        """Move the targets towards the critics by tau."""
        self.targets.update_parameters(self.critics)


class PlainSac(Agent):
    """Soft actor-critic by `PlainLoss`, with imitation."""

    loss: PlainLoss

    def build_loss(self, critics: list[Critic]) -> PlainLoss:
        """Make the plain loss on the device."""
        return PlainLoss(self.actor, critics, self.settings).to(self.device)

    def follow(self) -> None:
        """Let the target critics follow the critics by tau."""
        self.loss.follow()
