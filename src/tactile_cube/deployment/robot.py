"""What the control loop needs of a hand, be it simulated, reached through ROS 2 or through a program of your own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reading:
    """What the hand measured.

    Attributes:
        time: when, on the loop's clock [s].
        q_m: joint angles `(12,)` [rad], ring, middle, fore, thumb x (q1, q2, q3).
        dq: joint velocities `(12,)` [rad/s].
        torque: joint torques `(12,)` [N m]; None: not measured.
    """

    time: float
    q_m: Array
    dq: Array
    torque: Array | None = None


class Robot(Protocol):
    """A hand under an impedance controller tau = K_P (q_d - q_m) - K_D dq."""

    def wait(self) -> float:
        """Wait for the next tick of the fast loop; return its time [s]."""
        ...

    def read(self) -> Reading | None:
        """Return the newest measurement, or None if none has come since the last call."""
        ...

    def send(self, q_d: Array) -> None:
        """Give the impedance controller its desired angles `(12,)` [rad]."""
        ...

    def hand_over(self) -> None:
        """Called once, when the fingers are in place: somebody may now put the cube between them."""
        ...

    def close(self) -> None:
        """End the connection."""
        ...
