"""The policy as it runs on the hand: at 10 Hz from measured joint angles to desired ones."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.agent.policy_file import read_policy
from tactile_cube.deployment.training_setting import training_setting
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.measurement.bench import excitation

Weights = NDArray[np.float32]
Array = NDArray[np.float64]

POLICY_RATE = 10.0  # rate at which the policy is asked [Hz]


@dataclass(frozen=True)
class Network:
    """Linear layers with ReLU between them; the first half of the last layer's outputs, through tanh, is the action.

    Attributes:
        weights: one matrix `(out, in)` a layer, float32, as the biases `(out,)`.
        info: the policy file's metadata.
        label: how the policy is called in a message.
    """

    weights: tuple[Weights, ...]
    biases: tuple[Weights, ...]
    info: dict[str, Any]
    label: str = "the policy"

    @property
    def observation_size(self) -> int:
        """Width of the stacked observation."""
        return int(self.weights[0].shape[1])

    @property
    def action_size(self) -> int:
        """Number of joints; the other half of the outputs is the exploration's scale."""
        return int(self.weights[-1].shape[0]) // 2

    def deterministic_layers(self) -> list[tuple[Weights, Weights]]:
        """Return weights and biases without the outputs that only exploration uses."""
        layers = list(zip(self.weights, self.biases, strict=True))
        weight, bias = layers.pop()
        return [*layers, (weight[: self.action_size], bias[: self.action_size])]

    def __call__(self, observation: Weights) -> Weights:
        """Return the action `(..., 12)` in [-1, 1] for observations `(..., 120)`."""
        *hidden, (last, offset) = self.deterministic_layers()
        signal = observation
        for weight, bias in hidden:
            signal = np.maximum(signal @ weight.T + bias, 0.0)
        return np.asarray(np.tanh(signal @ last.T + offset), dtype=np.float32)


def read_network(path: Path) -> Network:
    """Read a policy file; raises what `read_policy` does."""
    info, layers = read_policy(path)
    weights, biases = zip(*layers, strict=True)
    return Network(weights, biases, info.model_dump(), f"policy={path}")


class PolicyController:
    """Runs the network at 10 Hz: `step` returns q_n from q_m of the hand and q_f of the fast loop's filter.

    Args:
        network: the policy.
        hand: whose action range the outputs are scaled to; None: the one that it was trained on.

    Example:
        >>> controller = PolicyController(read_network(Path("policy.safetensors")))
        >>> controller.reset()
        >>> q_n = controller.step(q_m, q_f)
    """

    def __init__(self, network: Network, hand: Hand | None = None) -> None:
        hand = hand or training_setting(network.info).hand
        self._reading = 2 * hand.joints  # q_m and e_q of every joint
        if network.observation_size % self._reading or network.action_size != hand.joints:
            raise InputError(
                f"the policy maps {network.observation_size} numbers to {network.action_size}; this controller "
                f"gives it readings of {self._reading} and expects {hand.joints} joints"
            )
        self._network = network
        self._middle = 0.5 * (hand.action_lower + hand.action_upper)
        self._half_range = 0.5 * (hand.action_upper - hand.action_lower)
        self._readings = network.observation_size // self._reading
        self._stack: NDArray[np.float32] | None = None

    def reset(self) -> None:
        """Forget the past: the next reading fills the whole stack, as at the start of an episode."""
        self._stack = None

    def step(self, q_m: Array, q_f: Array) -> Array:
        """Return q_n for the next 0.1 s, for q_m and q_f of the same instant, all `(joints,)` [rad]."""
        reading = np.concatenate([q_m, np.asarray(q_f) - q_m]).astype(np.float32)
        if self._stack is None:
            self._stack = np.tile(reading, self._readings)
        else:
            self._stack = np.concatenate([self._stack[self._reading :], reading])
        return np.asarray(self._middle + self._half_range * self._network(self._stack))


class PlayedTargets:
    """Plays the rows of `targets` `(steps, 12)` [rad] at 10 Hz, then repeats the last one."""

    def __init__(self, targets: Array) -> None:
        self._targets, self._row = targets, 0

    def reset(self) -> None:
        """Begin with the first row."""
        self._row = 0

    def step(self, q_m: Array, q_f: Array) -> Array:
        """Return the next row `(12,)` [rad], whatever the fingers do."""
        row = self._targets[min(self._row, len(self._targets) - 1)]
        self._row += 1
        return np.asarray(row)


def excited_targets(kind: str, reach: float, seconds: float, seed: int, hand: Hand = DLR_HAND2) -> PlayedTargets:
    """Return an excitation of `reach` [rad] about the start angles, within the action range.

    Raises:
        InputError: an unknown kind; see `excitation`.
    """
    home = np.asarray(hand.start_angles)
    low, high = np.maximum(home - reach, hand.action_lower), np.minimum(home + reach, hand.action_upper)
    return PlayedTargets(excitation(kind, low, high, seconds, POLICY_RATE, np.random.default_rng(seed)))
