"""What only the critics see: the object's state."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.data import Composite, Unbounded
from torchrl.envs.transforms import Transform

POSITION = 1.0 / 0.01
"""A cube moves by about a centimetre."""
TILT = 1.0 / 0.1
"""It tilts by about 0.1 rad."""
VELOCITY = 1.0 / 0.05
"""It moves at some centimetres a second."""
SCALE = (POSITION,) * 3 + (1.0, 1.0) + (TILT,) * 2 + (VELOCITY,) * 3 + (1.0,) * 3 + (1.0,) * 12


class PrivilegedState(Transform):  # type: ignore[misc]
    """Renames "object_state" to "privileged", in units in which its entries are of the size of one.

    In metres the cube's motion would be a hundred times smaller than the joint angles beside it, and the critics,
    whose weights decay, could hardly use it.

    Example:
        >>> env = TransformedEnv(worlds, PrivilegedState())  # privileged (25,)
    """

    def __init__(self, scale: tuple[float, ...] = SCALE) -> None:
        """Multiplies the entries by `scale`."""
        super().__init__(in_keys=["object_state"], out_keys=["privileged"])
        self.scale: Tensor = torch.tensor(scale)

    def _call(self, next_tensordict: TensorDictBase) -> TensorDictBase:
        return next_tensordict.set("privileged", next_tensordict.pop("object_state") * self.scale)

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        return self._call(tensordict_reset)

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Renames the key."""
        shape = observation_spec["object_state"].shape
        del observation_spec["object_state"]
        observation_spec["privileged"] = Unbounded(shape)
        return observation_spec
