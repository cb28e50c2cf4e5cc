"""Soft actor-critic by a loss of TorchRL: its SACLoss, TQCLoss, or a class derived from one."""

from collections.abc import Callable
from functools import partial
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModule
from torchrl.data import Bounded
from torchrl.modules import ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import LossModule, SACLoss, SoftUpdate

from tactile_cube.agent.agent import Agent
from tactile_cube.agent.networks import Actor, Critic, Sizes
from tactile_cube.errors import InputError

CRITIC_KEYS = ["observation", "privileged", "action"]


def stochastic_actor(actor: Actor, action_size: int) -> ProbabilisticActor:
    """Return the actor as TorchRL's tanh-normal policy: it reads "observation" only and writes "action"."""
    return ProbabilisticActor(
        module=TensorDictModule(actor, in_keys=["observation"], out_keys=["loc", "scale"]),
        in_keys=["loc", "scale"],
        spec=Bounded(-1.0, 1.0, (action_size,)),
        distribution_class=TanhNormal,
        return_log_prob=False,
    )


class Sac(Agent):
    """Soft actor-critic from TorchRL's parts.

    Args:
        sizes: widths of the signals.
        loss: makes a loss of TorchRL from a stochastic `actor_network` and a list `qvalue_network`.
        settings: number and outputs of critics, and `AgentSettings`.

    Raises:
        InputError: a loss that takes other networks, or imitation, which TorchRL's losses do not know.
    """

    def __init__(
        self,
        sizes: Sizes,
        loss: Callable[..., LossModule] = partial(SACLoss, loss_function="l2"),  # noqa: B008
        **settings: Any,
    ):
        self._make = loss
        try:
            super().__init__(sizes, **settings)
            self._try_losses()
        except (TypeError, RuntimeError, LookupError, AttributeError) as error:
            raise InputError(
                f"agent.loss: {error}; give SACLoss, TQCLoss or a class derived from one, as conf/agent/tqc.yaml does"
            ) from error

    def build_loss(self, critics: list[Critic]) -> LossModule:
        """Make TorchRL's loss with its targets."""
        weight = self.settings.demonstration_weight
        if weight:
            raise InputError(
                f"agent.demonstration_weight={weight:g}: TorchRL's losses do not imitate; set it to 0, or take "
                "agent=plain_sac"
            )
        loss = self._make(
            actor_network=stochastic_actor(self.actor, self.sizes.action),
            qvalue_network=[ValueOperator(critic, in_keys=CRITIC_KEYS) for critic in critics],
            num_qvalue_nets=len(critics),
            alpha_init=self.settings.alpha_init,
            target_entropy=self.settings.target_entropy,
            deactivate_vmap=True,  # a plain loop over critics is faster than vmap on a CPU
        )
        loss.make_value_estimator(gamma=self.settings.gamma)
        loss = loss.to(self.device)
        self._targets = SoftUpdate(loss, tau=self.settings.tau)
        return loss

    def _try_losses(self) -> None:
        """Ask for what an update needs of a made-up batch: a loss that does not fit is told before any episode."""
        sizes, one, no = self.sizes, torch.ones(2, 1), torch.zeros(2, 1, dtype=torch.bool)
        state = {"observation": torch.zeros(2, sizes.observation), "privileged": torch.zeros(2, sizes.privileged)}
        chosen = {"action": torch.zeros(2, sizes.action), "steps_to_next_obs": one}
        following = state | {"reward": one, "done": no, "terminated": no}
        with torch.random.fork_rng():  # training's random numbers stay the same
            losses = self.losses(TensorDict(state | chosen | {"next": following}, [2], device=self.device))
        losses.select("loss_qvalue", "loss_actor", "loss_alpha", "alpha")

    def losses(self, batch: TensorDictBase) -> TensorDictBase:
        """Return the output of TorchRL's loss, and the value of the actor's actions."""
        losses: TensorDictBase = self.loss(batch)
        return losses.set("value", (-losses["alpha"] * losses["entropy"] - losses["loss_actor"]).detach())

    def follow(self) -> None:
        """Let the target critics follow the critics by tau."""
        self._targets.step()
