"""What training asks of an agent, whichever composition stands behind it."""

from typing import Any, Protocol

from tensordict import TensorDictBase
from torch import Tensor

from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.settings import AgentSettings


class Agent(Protocol):
    """Soft actor-critic: `Agent(sizes, **settings)`; parameters are drawn from torch's global generator."""

    sizes: Sizes
    settings: AgentSettings

    def update(self, batch: TensorDictBase) -> dict[str, Tensor]:
        """One gradient step of critics, actor and temperature, then of the target critics.

        Args:
            batch: replayed transitions (size,), as TorchRL's losses read them. The reward sums "steps_to_next_obs"
                discounted ones, "terminated" leaves out time limits, "demonstrated" marks demonstrations.

        Returns:
            Scalars on the agent's device: critic_loss, actor_loss, alpha, entropy, value (mean Q of the batch).
        """

    def policy(self) -> Actor:
        """A copy of the actor on the CPU, detached from the learner."""

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on bit for bit: networks, targets, temperature, optimisers."""

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Inverse of `state_dict`; refuses a state of other shapes."""

    def load_networks(self, state: dict[str, Any]) -> None:
        """Warm start: take the networks of a state and keep fresh optimisers and temperature."""

    def load_actor(self, actor: Actor) -> None:
        """Warm start from a policy file alone: critics stay fresh."""

    def approximations(self) -> list[str]:
        """Deviations from exact float32 arithmetic, one sentence each, printed at the start of a run."""
