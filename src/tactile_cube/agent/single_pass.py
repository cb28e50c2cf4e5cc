"""AdamW, target update and the casts to bfloat16 in one pass over memory, for a learner on the CPU.

One after the other these operations move some 60 MB an update, more than a core's cache holds, and take a third as long
as the matrix products; in one pass it is half of that. The arithmetic is that of torch's AdamW.
"""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from tactile_cube.compiled import compiled_once

Floats = NDArray[np.float32]
Halves = NDArray[np.uint16]
"""Bits of bfloat16 numbers, which numpy does not know: the upper half of a float32."""


class SinglePass:
    """Steps flat float32 parameters from a bfloat16 gradient, and carries them to targets and bfloat16 copies.

    The optimizer keeps the moments, so that its state dict stays what it is; it skips the parameters itself because
    their `grad` is None.

    Args:
        optimizer: AdamW whose first group holds the parameters.
        parameters: flat float32 vector; its tail are the critics.
        working: their bfloat16 copy.
        gradient: of the parameters, in bfloat16.
        targets: flat float32 target critics.
        target_working: their bfloat16 copy.
        tau: share of the critics that flows into the targets.
    """

    def __init__(
        self,
        optimizer: torch.optim.AdamW,
        parameters: Tensor,
        working: Tensor,
        gradient: Tensor,
        targets: Tensor,
        target_working: Tensor,
        tau: float,
    ):
        parameters.grad = None
        self._optimizer, self._parameters, self._tau = optimizer, parameters, tau
        self._arrays = (parameters.numpy(), _bits(gradient), _bits(working))
        self._targets = (parameters.numpy()[-targets.numel() :], targets.numpy(), _bits(target_working))
        moments = {name: torch.zeros_like(parameters) for name in ("exp_avg", "exp_avg_sq")}
        optimizer.state[parameters] = {"step": torch.zeros(()), **moments}

    def step(self) -> None:
        """One step of the parameters and their targets."""
        state: dict[str, Any] = self._optimizer.state[self._parameters]
        group = self._optimizer.param_groups[0]
        state["step"] += 1.0
        steps = float(state["step"])
        beta1, beta2 = group["betas"]
        scales = (
            beta1,
            beta2,
            1.0 - group["lr"] * group["weight_decay"],
            group["lr"] / (1.0 - beta1**steps),
            1.0 / (1.0 - beta2**steps) ** 0.5,
            group["eps"],
        )
        adamw_step(*self._arrays, state["exp_avg"].numpy(), state["exp_avg_sq"].numpy(), *map(np.float32, scales))
        follow(*self._targets, np.float32(self._tau))


def _bits(tensor: Tensor) -> Halves:
    return tensor.view(torch.int16).numpy().view(np.uint16)


@compiled_once
def adamw_step(
    parameters: Floats,
    gradient: Halves,
    working: Halves,
    mean: Floats,
    square: Floats,
    beta1: np.float32,
    beta2: np.float32,
    keep: np.float32,
    rate: np.float32,
    inverse_root: np.float32,
    eps: np.float32,
) -> None:
    """AdamW on `parameters` (n,) with moments `mean` and `square`, and the new ones rounded to bfloat16 in `working`.

    `keep` is 1 - learning rate * weight decay, `rate` the learning rate over the bias correction of the first moment,
    `inverse_root` 1 / sqrt(bias correction of the second moment).
    """
    one = np.float32(1.0)
    for i in range(parameters.shape[0]):
        slope = np.uint32(np.uint32(gradient[i]) << np.uint32(16)).view(np.float32)
        mean[i] = mean[i] + (one - beta1) * (slope - mean[i])
        square[i] = beta2 * square[i] + (one - beta2) * slope * slope
        value = keep * parameters[i] - rate * mean[i] / (np.sqrt(square[i]) * inverse_root + eps)
        parameters[i] = value
        bits = np.float32(value).view(np.uint32)
        # to the nearest, ties to even, as torch rounds
        working[i] = np.uint16((bits + np.uint32(0x7FFF) + ((bits >> np.uint32(16)) & np.uint32(1))) >> np.uint32(16))


@compiled_once
def follow(online: Floats, targets: Floats, working: Halves, tau: np.float32) -> None:
    """Soft target update of `targets` (n,), and the new ones rounded to bfloat16 in `working`."""
    for i in range(online.shape[0]):
        value = targets[i] + tau * (online[i] - targets[i])
        targets[i] = value
        bits = np.float32(value).view(np.uint32)
        working[i] = np.uint16((bits + np.uint32(0x7FFF) + ((bits >> np.uint32(16)) & np.uint32(1))) >> np.uint32(16))
