"""The actor in numpy: what runs on the robot's computer, without torch."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.agent.policy_file import read_policy

Array = NDArray[np.float32]


@dataclass(frozen=True)
class Network:
    """Linear layers with ReLU between them; the first half of the last layer's outputs, through tanh, is the action.

    Attributes:
        weights: one matrix `(out, in)` a layer.
        biases: one vector `(out,)` a layer.
        info: the policy file's metadata.
        label: how the policy is called in a message.
    """

    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    info: dict[str, Any]
    label: str = "the policy"

    @property
    def observation_size(self) -> int:
        """Width of the stacked observation."""
        return int(self.weights[0].shape[1])

    @property
    def action_size(self) -> int:
        """Number of joints commanded; the other half of the outputs is the exploration's scale."""
        return int(self.weights[-1].shape[0]) // 2

    def deterministic_layers(self) -> list[tuple[Array, Array]]:
        """Return weights and biases without the outputs that only exploration uses."""
        layers = list(zip(self.weights, self.biases, strict=True))
        weight, bias = layers.pop()
        return [*layers, (weight[: self.action_size], bias[: self.action_size])]

    def __call__(self, observation: Array) -> Array:
        """Return the action `(..., 12)` in [-1, 1] for observations `(..., 120)`."""
        signal = observation
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            signal = np.maximum(signal @ weight.T + bias, 0.0)
        mean = signal @ self.weights[-1][: self.action_size].T + self.biases[-1][: self.action_size]
        return np.asarray(np.tanh(mean), dtype=np.float32)


def read_network(path: Path) -> Network:
    """Read a policy file; raises what `read_policy` does."""
    info, layers = read_policy(path)
    weights, biases = zip(*layers, strict=True)
    return Network(weights, biases, info.model_dump(), f"policy={path}")
