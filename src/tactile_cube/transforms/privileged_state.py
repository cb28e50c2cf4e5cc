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
OBJECT_SCALE = (POSITION,) * 3 + (1.0, 1.0) + (TILT,) * 2 + (VELOCITY,) * 3 + (1.0,) * 3


class PrivilegedState(Transform):  # type: ignore[misc]
    """Renames "object_state" to "privileged", in units in which its entries are of the size of one.

    In metres the cube's motion would be a hundred times smaller than the joint angles beside it, and the critics,
    whose weights decay, could hardly use it.

    Example:
        >>> env = TransformedEnv(worlds, PrivilegedState())  # privileged (25,)
    """

    def __init__(self, joints: int = 12, visible: bool = True) -> None:
        """Scales the entries of a hand with `joints` joints, angles not; all are zero where they are not `visible`."""
        super().__init__(in_keys=["object_state"], out_keys=["privileged"])
        self.scale: Tensor = torch.tensor(OBJECT_SCALE + (1.0,) * joints) * float(visible)

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
