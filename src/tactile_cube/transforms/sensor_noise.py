"""Noise of the joint encoders."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from torchrl.envs.transforms import Transform


class SensorNoise(Transform):  # type: ignore[misc]
    """Gaussian noise on q_m, and with the opposite sign on e_q = q_f - q_m, which is computed from the same reading.

    Draws from torch's global generator.

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
