"""The fast composition: SACLoss's arithmetic on flat parameters with a written backward pass, in fp32 or bf16.

In float32 losses and gradients equal those of `Sac` up to rounding (tests/agent/test_sac_fast.py).
"""

import copy
from typing import Any

import torch
from tensordict import TensorDictBase
from torch import Tensor

from tactile_cube.agent.flat_perceptron import FlatPerceptron, parameter_count
from tactile_cube.agent.networks import (
    LOG_SCALE_HIGH,
    LOG_SCALE_LOW,
    Actor,
    Sizes,
    build_networks,
    log_scale,
    squashed_log_prob,
)
from tactile_cube.agent.settings import AgentSettings
from tactile_cube.agent.single_pass import SinglePass


class FlatNetworks:
    """Actor, twin critics and target critics as views of three flat vectors."""

    def __init__(self, sizes: Sizes, settings: AgentSettings, device: torch.device):
        self.layout = {
            "actor": (sizes.observation, *settings.hidden, 2 * sizes.action),
            "critic": (sizes.critic, *settings.hidden, 1),
        }
        actor, critic = parameter_count(self.layout["actor"]), parameter_count(self.layout["critic"])
        dtype = settings.product_dtype
        self.master = torch.zeros(actor + 2 * critic, device=device)
        self.target_master = torch.zeros(2 * critic, device=device)
        self.critic_part = self.master[actor:]
        # in float32 the working copy *is* the master
        self.working = self.master.to(dtype)
        self.target_working = self.target_master.to(dtype)
        self.gradient = torch.zeros_like(self.working)
        self.actor = FlatPerceptron(self.layout["actor"], self.working[:actor], self.gradient[:actor])
        parts = [slice(actor + i * critic, actor + (i + 1) * critic) for i in (0, 1)]
        norm = settings.layer_norm
        self.critics = [FlatPerceptron(self.layout["critic"], self.working[p], self.gradient[p], norm) for p in parts]
        halves = self.target_working.chunk(2)
        self.targets = [FlatPerceptron(self.layout["critic"], half, None, norm) for half in halves]
        self.masters = [FlatPerceptron(self.layout["actor"], self.master[:actor], None)]
        self.masters += [FlatPerceptron(self.layout["critic"], self.master[p], None) for p in parts]

    def refresh(self) -> None:
        """Carry the masters' values to the working copies."""
        if self.working.dtype != self.master.dtype:
            self.working.copy_(self.master)
            self.target_working.copy_(self.target_master)


class FastSac:
    """Soft actor-critic, hand-written for one CPU core."""

    def __init__(self, sizes: Sizes, **settings: Any):
        self.sizes = sizes
        self.settings = AgentSettings(**settings)
        self.device = self.settings.torch_device()
        self.networks = FlatNetworks(sizes, self.settings, self.device)
        actor, critics = build_networks(sizes, self.settings.hidden, self.settings.layer_norm)
        for flat, body in zip(self.networks.masters, [actor.body, *(critic.body for critic in critics)], strict=True):
            flat.copy_from(body)
        self.networks.target_master.copy_(self.networks.critic_part)
        self.networks.refresh()
        self._actor_module = copy.deepcopy(actor).requires_grad_(False)
        self.log_alpha = torch.tensor(self.settings.alpha_init, device=self.device).log()
        self.log_alpha.grad = torch.zeros_like(self.log_alpha)
        master, gradient = self.networks.master, self.networks.gradient
        # a float32 gradient is the working gradient itself; a bfloat16 one is cast before the step
        master.grad = gradient if master.dtype == gradient.dtype else torch.zeros_like(master)
        self.optimizer = self.settings.optimizer([master], self.log_alpha)
        self._single_pass: SinglePass | None = None
        if master.dtype != gradient.dtype and self.device.type == "cpu":
            vectors = (master, self.networks.working, gradient, self.networks.target_master)
            self._single_pass = SinglePass(self.optimizer, *vectors, self.networks.target_working, self.settings.tau)

    @torch.no_grad()
    def update(self, batch: TensorDictBase) -> dict[str, Tensor]:
        """One step of critics, actor and temperature, then of the target critics."""
        metrics = self.compute_gradients(batch.to(self.device))
        self.step()
        return metrics

    @torch.no_grad()
    def step(self) -> None:
        """Follow the gradients last computed: networks, temperature, targets, working copies."""
        if self._single_pass is not None:
            self.optimizer.step()  # the temperature alone
            self._single_pass.step()
            return
        networks = self.networks
        if networks.gradient.dtype != networks.master.dtype:
            networks.master.grad.copy_(networks.gradient)  # type: ignore[union-attr]
        self.optimizer.step()
        networks.target_master.lerp_(networks.critic_part, self.settings.tau)
        networks.refresh()

    @torch.no_grad()
    def compute_gradients(self, batch: TensorDictBase) -> dict[str, Tensor]:
        """Losses of the batch, and their gradients written into the flat gradient and log_alpha.grad.

        The actor is evaluated once on next and current observations together, the critics once on replayed and proposed
        actions together: all of them see the parameters before the step, as in SACLoss.
        """
        size = batch["next", "reward"].shape[0]
        first, second = slice(0, size), slice(size, 2 * size)
        alpha = self.log_alpha.exp()

        observations = self._cast(torch.cat((batch["next", "observation"], batch["observation"])))
        output, actor_kept = self.networks.actor.forward(observations)
        mean, raw = output.float().chunk(2, -1)
        noise = torch.cat([torch.randn_like(mean[first]), torch.randn_like(mean[second])])
        log_sigma = log_scale(raw)
        deviation = log_sigma.exp() * noise
        pre_tanh = mean + deviation
        action = torch.tanh(pre_tanh)
        log_prob = squashed_log_prob(noise, log_sigma, pre_tanh)

        target = self._target(batch, action[first], alpha * log_prob[first])
        critic_loss, values, action_gradient, better = self._critics(batch, action[second], target)

        # d/du of alpha log pi(u) is 2 alpha tanh(u) (its other part enters through log sigma)
        share = alpha / size
        a = action[second]
        pre_gradient = 2.0 * share * a + action_gradient * (1.0 - a.square())
        sigma_gradient = pre_gradient * deviation[second] - share
        mean_gradient = pre_gradient + self._imitation_gradient(batch, torch.tanh(mean[second]), better)
        slope = 0.5 * (LOG_SCALE_HIGH - LOG_SCALE_LOW) * (1.0 - torch.tanh(raw[second]).square())
        mine = [(x[second], product[second], mean, inverse) for x, product, mean, inverse in actor_kept]
        actor_gradient = self._cast(torch.cat((mean_gradient, sigma_gradient * slope), -1))
        self.networks.actor.backward(mine, actor_gradient, slice(None))

        mean_log_prob = log_prob[second].mean()
        self.log_alpha.grad.copy_(-(mean_log_prob + self.settings.target_entropy))  # type: ignore[union-attr]
        return {
            "critic_loss": critic_loss,
            "actor_loss": alpha * mean_log_prob - values.mean(),
            "alpha": alpha,
            "entropy": -mean_log_prob,
            "value": values.mean(),
        }

    def _imitation_gradient(self, batch: TensorDictBase, likeliest: Tensor, better: Tensor) -> Tensor | float:
        """Gradient by the actor's mean of weight * |tanh(mean) - a|^2 over demonstrated actions a that are better."""
        weight = self.settings.demonstration_weight
        if not weight:
            return 0.0
        action: Tensor = batch["action"]
        share: Tensor = weight / len(better) * batch["demonstrated"] * better
        return 2.0 * share * (likeliest - action) * (1.0 - likeliest.square())

    def _cast(self, x: Tensor) -> Tensor:
        return x.to(self.networks.working.dtype)

    def _target(self, batch: TensorDictBase, action: Tensor, entropy_cost: Tensor) -> Tensor:
        """Soft bootstrapped return (batch, 1)."""
        x = self._cast(torch.cat((batch["next", "observation"], batch["next", "privileged"], action), -1))
        lowest = torch.minimum(*(critic.forward(x)[0].float() for critic in self.networks.targets))
        discount: Tensor = self.settings.gamma ** batch["steps_to_next_obs"] * ~batch["next", "terminated"]
        reward: Tensor = batch["next", "reward"]
        return reward + discount * (lowest - entropy_cost)

    def _critics(
        self, batch: TensorDictBase, proposed: Tensor, target: Tensor
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Critic loss, the lower of the two values of the proposed actions, and minus its gradient by the action.

        Last, 1 where the replayed action is worth more than the proposed one. The critics' parameter gradients come
        from the replayed half, the action's gradient from the proposed half.
        """
        size = target.shape[0]
        first, second = slice(0, size), slice(size, 2 * size)
        state = torch.cat((batch["observation"], batch["privileged"]), -1)
        x = self._cast(torch.cat((torch.cat((state, batch["action"]), -1), torch.cat((state, proposed), -1))))
        passes = [critic.forward(x) for critic in self.networks.critics]
        q1, q2 = (output.float() for output, _ in passes)
        use_first = (q1[second] <= q2[second]).float()
        loss = torch.zeros((), device=x.device)
        action_gradient = torch.zeros_like(proposed)
        for critic, q, (_, kept), used in zip(
            self.networks.critics, (q1, q2), passes, (use_first, 1.0 - use_first), strict=True
        ):
            error = q[first] - target
            loss += error.square().mean()
            gradient = self._cast(torch.cat((error * (2.0 / size), used * (-1.0 / size))))
            at_first = critic.backward(kept, gradient, first)
            columns = slice(self.sizes.critic - self.sizes.action, self.sizes.critic)
            action_gradient += critic.input_gradient(at_first[second], columns).float()
        lower = torch.minimum(q1, q2)
        return loss, lower[second], action_gradient, (lower[first] > lower[second]).float()

    def policy(self) -> Actor:
        """A copy of the actor on the CPU, detached from the learner."""
        actor = copy.deepcopy(self._actor_module)
        self.networks.masters[0].copy_to(actor.body)
        return actor

    def state_dict(self) -> dict[str, Any]:
        """Networks, targets, temperature and optimiser."""
        return {
            "parameters": self.networks.master,
            "targets": self.networks.target_master,
            "log_alpha": self.log_alpha,
            "optimizer": self.optimizer.state_dict(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Inverse of `state_dict`."""
        self.load_networks(state)
        self.log_alpha.copy_(state["log_alpha"])
        self.optimizer.load_state_dict(state["optimizer"])

    def load_networks(self, state: dict[str, Any]) -> None:
        """Warm start: networks and targets of a state, fresh optimiser and temperature."""
        for own, saved in ((self.networks.master, "parameters"), (self.networks.target_master, "targets")):
            own.copy_(state[saved].view_as(own))  # a single number would be copied to all
        self.networks.refresh()

    def load_actor(self, actor: Actor) -> None:
        """Warm start of the actor alone."""
        self.networks.masters[0].copy_from(actor.body)
        self.networks.refresh()

    def approximations(self) -> list[str]:
        """What departs from exact float32."""
        if self.settings.product_dtype != torch.bfloat16:
            return []
        asked = f"agent.precision={self.settings.precision}"
        return [f"{asked}: matrix products and gradients in bfloat16, parameters and optimiser in float32"]
