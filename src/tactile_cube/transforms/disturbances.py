"""Disturbances of sensing and acting: joint offsets, sensor noise, sticky actions; all draw from torch's generator."""

from collections.abc import Sequence

import torch
from tensordict import NestedKey, TensorDictBase
from torch import Tensor
from torchrl.envs.transforms import Transform

from tactile_cube.randomization import Distribution


def reset_mask(tensordict: TensorDictBase, fresh: TensorDictBase) -> Tensor:
    """Return the worlds that start an episode, `(*batch, 1)` bool: of "_reset" in `tensordict`, or all of `fresh`."""
    mask: Tensor | None = tensordict.get("_reset", None)
    if mask is None:
        return torch.ones((*fresh.batch_size, 1), dtype=torch.bool)
    return mask.reshape(*fresh.batch_size, 1)


class JointOffset(Transform):  # type: ignore[misc]
    """Joint offset: encoders read o too much, constant over an episode.

    The impedance controller regulates what the encoders read, and targets are angles as the encoders would read them.
    So q_m appears as q_m + o, a desired angle q_n means the true angle q_n - o, and e_q = q_f - q_m does not change:
    the hand behaves as if it were mounted a little wrong, and neither policy nor controller can tell. This is exact,
    and the same as the world's own `joint_offset`.

    Partial resets draw for the worlds that are reset and keep the others' offsets.

    Example:
        >>> env = TransformedEnv(worlds, JointOffset(Uniform(-0.03, 0.03), half_range=half_range))
    """

    offset: Tensor

    def __init__(
        self,
        distribution: Distribution,
        half_range: Tensor,
        in_keys: Sequence[NestedKey] = ("joint_position",),
        in_keys_inv: Sequence[NestedKey] = ("action",),
    ) -> None:
        """Draw each joint's offset from `distribution` [rad]; an action of 1 means `half_range` (joints,) [rad].

        Args:
            distribution: of the offsets.
            half_range: of the actions, and the number of joints.
            in_keys: readings that are offset.
            in_keys_inv: actions that mean what the offset encoders would read.
        """
        super().__init__(in_keys=in_keys, out_keys=in_keys, in_keys_inv=in_keys_inv, out_keys_inv=in_keys_inv)
        self.distribution = distribution
        self.half_range = half_range
        self.offset = torch.zeros_like(half_range)

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        mask = reset_mask(tensordict, tensordict_reset)
        uniform = torch.rand((*mask.shape[:-1], len(self.half_range)), dtype=torch.float64)
        drawn = torch.from_numpy(self.distribution.quantile(uniform.numpy())).float()
        self.offset = torch.where(mask, drawn, self.offset)
        return self._call(tensordict_reset)

    def _apply_transform(self, obs: Tensor) -> Tensor:
        return obs + self.offset

    def _inv_apply_transform(self, state: Tensor) -> Tensor:
        return state - self.offset / self.half_range


class SensorNoise(Transform):  # type: ignore[misc]
    """Gaussian noise on q_m, and with the opposite sign on e_q = q_f - q_m, which is computed from the same reading.

    Example:
        >>> env = TransformedEnv(worlds, SensorNoise(0.002))
    """

    def __init__(
        self,
        std: float,
        in_keys: Sequence[NestedKey] = ("joint_position",),
        opposite: Sequence[NestedKey] = ("control_error",),
    ) -> None:
        """Add noise of standard deviation `std` [rad] on each of `in_keys`; `opposite` are computed from the first."""
        super().__init__(in_keys=in_keys, out_keys=in_keys)
        self.std, self.opposite = std, tuple(opposite)

    def _call(self, next_tensordict: TensorDictBase) -> TensorDictBase:
        noises = [self.std * torch.randn_like(next_tensordict.get(key)) for key in self.in_keys]
        for key, noise in zip(self.in_keys, noises, strict=True):
            next_tensordict.set(key, next_tensordict.get(key) + noise)
        for key in self.opposite:
            next_tensordict.set(key, next_tensordict.get(key) - noises[0])
        return next_tensordict

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        return self._call(tensordict_reset)


class StickyAction(Transform):  # type: ignore[misc]
    """With some probability a world repeats the action it executed last, whatever the policy says now.

    The first step of an episode is never sticky. The tensordict keeps the policy's action: repeating is the
    environment's noise.

    Example:
        >>> env = TransformedEnv(worlds, StickyAction(0.1))
    """

    def __init__(self, probability: float, in_keys_inv: Sequence[NestedKey] = ("action",)) -> None:
        """Repeat the action of the one given key with `probability` at each step, independently in each world.

        Raises:
            ValueError: several keys.
        """
        if len(in_keys_inv) != 1:
            raise ValueError(f"in_keys_inv={list(in_keys_inv)}: a sticky action is one; give one transform a key")
        super().__init__(in_keys_inv=in_keys_inv, out_keys_inv=in_keys_inv)
        self.probability = probability
        self._last: Tensor | None = None
        self._fresh: Tensor | None = None

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        mask = reset_mask(tensordict, tensordict_reset)
        self._fresh = mask if self._fresh is None else self._fresh | mask
        return tensordict_reset

    def _inv_apply_transform(self, state: Tensor) -> Tensor:
        stick = torch.rand((*state.shape[:-1], 1)) < self.probability
        if self._fresh is not None:
            stick &= ~self._fresh
        self._last = torch.where(stick, state if self._last is None else self._last, state)
        self._fresh = torch.zeros_like(stick)
        return self._last
