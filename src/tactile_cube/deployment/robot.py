"""What the control loop needs of a hand, be it simulated, reached through ROS 2 or through a program of your own."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reading:
    """What the hand measured.

    Attributes:
        time: when, on the clock of `Robot.wait` [s].
        q_m: joint angles `(joints,)` [rad], in the hand's order.
        torque: joint torques `(joints,)` [N m]; None: not measured.
    """

    time: float
    q_m: Array
    torque: Array | None = None


class Robot(Protocol):
    """A hand under an impedance controller tau = K_P (q_d - q_m) - K_D dq that keeps the last q_d it was sent.

    Its own controller has to take q_m for q_d once no command has come for `stop.timeout`: a program can be killed.
    """

    def wait(self) -> float:
        """Wait for the next tick of the fast loop; return its time on a monotonic clock [s]."""

    def read(self) -> Reading | None:
        """Return the newest measurement, or None if none has come since the last call."""

    def send(self, q_d: Array) -> None:
        """Give the impedance controller its desired angles `(joints,)` [rad]."""

    def wait_for_object(self) -> bool:
        """Return whether somebody confirmed, here at the robot, that the object is between the open fingers.

        Called every tick while the loop waits for it; Enter on the terminal confirms too.
        """

    def release(self) -> None:
        """Called once, when the policy begins to decide: whoever holds the object lets go of it."""

    def close(self) -> None:
        """End the connection."""
