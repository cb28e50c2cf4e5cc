"""Disturbances of sensing and acting: joint offsets, sensor noise, sticky actions; all draw from torch's generator."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.envs.transforms import Transform

from tactile_cube.randomization import Distribution


def reset_mask(tensordict: TensorDictBase, fresh: TensorDictBase) -> Tensor:
    """Worlds that start an episode now, `(*batch, 1)` bool: those of "_reset" in `tensordict`, or all of `fresh`."""
    mask: Tensor | None = tensordict.get("_reset", None)
    if mask is None:
        return torch.ones((*fresh.batch_size, 1), dtype=torch.bool)
    return mask.reshape(*fresh.batch_size, 1)


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


class SensorNoise(Transform):  # type: ignore[misc]
    """Gaussian noise on q_m, and with the opposite sign on e_q = q_f - q_m, which is computed from the same reading.

    Example:
        >>> env = TransformedEnv(worlds, SensorNoise(0.002))
    """

    def __init__(self, std: float) -> None:
        """Noise of standard deviation `std` [rad]."""
        super().__init__()
        self.std = std

    def _call(self, next_tensordict: TensorDictBase) -> TensorDictBase:
        position = next_tensordict.get("joint_position")
        noise = self.std * torch.randn_like(position)
        next_tensordict.set("joint_position", position + noise)
        return next_tensordict.set("control_error", next_tensordict.get("control_error") - noise)

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        return self._call(tensordict_reset)


class StickyAction(Transform):  # type: ignore[misc]
    """With some probability a world repeats the action it executed last, whatever the policy says now.

    The first step of an episode is never sticky. The tensordict keeps the policy's action: repeating is the
    environment's noise.

    Example:
        >>> env = TransformedEnv(worlds, StickyAction(0.1))
    """

    def __init__(self, probability: float) -> None:
        """Repeats with `probability` at each step, independently in each world."""
        super().__init__()
        self.probability = probability
        self._last: Tensor | None = None
        self._fresh: Tensor | None = None

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        mask = reset_mask(tensordict, tensordict_reset)
        self._fresh = mask if self._fresh is None else self._fresh | mask
        return tensordict_reset

    def _inv_call(self, tensordict: TensorDictBase) -> TensorDictBase:
        action = tensordict.get("action")
        if self._fresh is None or self._last is None:
            self._last = action
        stick = torch.rand((*action.shape[:-1], 1)) < self.probability
        if self._fresh is not None:
            stick &= ~self._fresh
        self._last = torch.where(stick, self._last, action)
        self._fresh = torch.zeros_like(stick)
        return tensordict.set("action", self._last)
