"""What the policy sees: the last few readings of q_m and e_q, and nothing else."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.data import Composite, Unbounded
from torchrl.envs.transforms import Transform

from tactile_cube.transforms.partial_reset import reset_mask

PARTS = ("joint_position", "control_error")


class ObservationStack(Transform):  # type: ignore[misc]
    """Stacks the last `steps` readings of (q_m, e_q) into "observation", the oldest first, and takes the parts away.

    After a reset the first reading fills the whole stack; partial resets leave the other worlds' stacks alone.
    Nothing but the two joint signals enters here, so the policy cannot see the object. Source: paper, section II.

    Example:
        >>> env = TransformedEnv(worlds, ObservationStack(5))  # observation (120,)
    """

    def __init__(self, steps: int) -> None:
        """Keeps `steps` readings (N_stack)."""
        super().__init__(in_keys=list(PARTS), out_keys=["observation"])
        self.steps = steps
        self._stack: Tensor | None = None

    def _reading(self, tensordict: TensorDictBase) -> Tensor:
        return torch.cat([tensordict.pop(key) for key in PARTS], dim=-1)

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        reading = self._reading(tensordict_reset)
        filled = torch.cat([reading] * self.steps, dim=-1)
        if self._stack is not None:
            filled = torch.where(reset_mask(tensordict, tensordict_reset), filled, self._stack)
        self._stack = filled
        return tensordict_reset.set("observation", self._stack)

    def _call(self, next_tensordict: TensorDictBase) -> TensorDictBase:
        reading = self._reading(next_tensordict)
        assert self._stack is not None, "an environment is reset before it is stepped"
        self._stack = torch.cat([self._stack[..., reading.shape[-1] :], reading], dim=-1)
        return next_tensordict.set("observation", self._stack)

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Replaces the parts by "observation"."""
        size = sum(observation_spec[key].shape[-1] for key in PARTS)
        for key in PARTS:
            del observation_spec[key]
        observation_spec["observation"] = Unbounded((*observation_spec.shape, self.steps * size))
        return observation_spec
