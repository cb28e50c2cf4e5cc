"""Zero errors of the joint encoders, drawn anew for each episode."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.envs.transforms import Transform

from tactile_cube.randomization import Distribution
from tactile_cube.transforms.partial_reset import reset_mask


class JointOffset(Transform):  # type: ignore[misc]
    """Encoders that read o too much, the same all episode long.

    The impedance controller regulates what the encoders read, and targets are angles as the encoders would read them.
    So q_m appears as q_m + o, a desired angle q_n means the true angle q_n - o, and e_q = q_f - q_m does not change:
    the hand behaves as if it were mounted a little wrong, and neither policy nor controller can tell. This is exact,
    and the same as the world's own `joint_offset`.

    Partial resets draw for the worlds that are reset and keep the others' offsets.

    Example:
        >>> env = TransformedEnv(worlds, JointOffset(Uniform(-0.03, 0.03), half_range=half_range))
    """

    offset: Tensor

    def __init__(self, distribution: Distribution, half_range: Tensor) -> None:
        """Draws each joint's offset from `distribution` [rad]; an action of 1 means `half_range` (12,) [rad]."""
        super().__init__()
        self.distribution = distribution
        self.half_range = half_range
        self.offset = torch.zeros_like(half_range)

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        mask = reset_mask(tensordict, tensordict_reset)
        uniform = torch.rand((*mask.shape[:-1], len(self.half_range)), dtype=torch.float64)
        drawn = torch.from_numpy(self.distribution.quantile(uniform.numpy())).float()
        self.offset = torch.where(mask, drawn, self.offset)
        return self._call(tensordict_reset)

    def _call(self, next_tensordict: TensorDictBase) -> TensorDictBase:
        return next_tensordict.set("joint_position", next_tensordict.get("joint_position") + self.offset)

    def _inv_call(self, tensordict: TensorDictBase) -> TensorDictBase:
        return tensordict.set("action", tensordict.get("action") - self.offset / self.half_range)
