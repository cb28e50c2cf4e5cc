"""What acts while data is collected: the stochastic actor, or uniform actions in the first steps of a run."""

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase

from tactile_cube.agent.networks import Actor


class Behaviour(TensorDictModuleBase):  # type: ignore[misc]
    """Policy of the collectors: reads "observation", writes "action".

    Whether actions are random travels with the weights as a buffer, so that it reaches every worker in the same
    iteration and survives a resume. Noise comes from torch's global generator of the worker.

    Args:
        actor: its own copy, never the learner's.
    """

    in_keys = ["observation"]  # noqa: RUF012 - the name and type TorchRL asks for
    out_keys = ["action"]  # noqa: RUF012

    def __init__(self, actor: Actor):
        super().__init__()
        self.actor = actor.requires_grad_(False)
        self.register_buffer("random", torch.zeros(()))

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Sample an action for each world."""
        mean, scale = self.actor(tensordict["observation"])
        action = torch.tanh(mean + scale * torch.randn_like(mean))
        if self.random:
            action = torch.rand_like(action) * 2.0 - 1.0
        return tensordict.set("action", action)
