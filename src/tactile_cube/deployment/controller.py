"""The policy as it runs on the hand: at 10 Hz from measured joint angles to desired ones."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tactile_cube.deployment.network import Network
from tactile_cube.drivetrain.target_filter import low_pass
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, HandModel

Array = NDArray[np.float64]

POLICY_RATE = 10.0
"""Rate at which the policy is asked [Hz]."""
READING = 24
"""Numbers in one reading: q_m (12) and e_q (12)."""


class Controller:
    """Asks the network at 10 Hz.

    Once a policy step: read q_m from the hand and q_f from the filter that runs in the fast loop, call `step`, and give
    its q_n to the filter.

    Args:
        network: the policy.
        hand: whose action range the outputs are scaled to.

    Example:
        >>> controller = Controller(read_network(Path("policy.safetensors")))
        >>> controller.reset()
        >>> q_n = controller.step(q_m, q_f)
    """

    def __init__(self, network: Network, hand: HandModel = DLR_HAND2) -> None:
        if network.observation_size % READING or network.action_size != len(hand.joint_names):
            raise InputError(
                f"the policy maps {network.observation_size} numbers to {network.action_size}; this controller "
                f"gives it readings of {READING} and expects {len(hand.joint_names)} joints"
            )
        self._network = network
        self._middle = 0.5 * (hand.action_lower + hand.action_upper)
        self._half_range = 0.5 * (hand.action_upper - hand.action_lower)
        self._readings = network.observation_size // READING
        self._stack: NDArray[np.float32] | None = None

    def reset(self) -> None:
        """Forget the past: the next reading fills the whole stack, as at the start of an episode."""
        self._stack = None

    def step(self, q_m: Array, q_f: Array) -> Array:
        """Return the desired joint angles q_n `(12,)` [rad] for the next 0.1 s.

        Args:
            q_m: measured joint angles `(12,)` [rad], ring, middle, fore, thumb x (q1, q2, q3).
            q_f: filtered targets at the same instant `(12,)` [rad].
        """
        reading = np.concatenate([q_m, np.asarray(q_f) - q_m]).astype(np.float32)
        if self._stack is None:
            self._stack = np.tile(reading, self._readings)
        else:
            self._stack = np.concatenate([self._stack[READING:], reading])
        return np.asarray(self._middle + self._half_range * self._network(self._stack))


@dataclass
class TargetFilter:
    """The low-pass between q_n and q_f, run in the fast loop.

    Attributes:
        time_constant: T_s [s]: 0.5 at the end of the paper's training.
        rate: of the fast loop [Hz]: 500 in simulation, 1000 on the robot.
        filtered: q_f `(12,)` [rad]; set it to the measured angles before the first step.
    """

    time_constant: float
    rate: float
    filtered: Array = field(default_factory=lambda: np.zeros(12))

    def step(self, q_n: Array) -> Array:
        """Advance by one period of the fast loop and return q_f `(12,)` [rad]."""
        for joint, goal in enumerate(q_n):
            self.filtered[joint] = low_pass(self.filtered[joint], goal, self.time_constant, 1.0 / self.rate)
        return self.filtered
