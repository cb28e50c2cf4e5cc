"""What a physics engine does for the world: bodies, contacts and time steps under the drive's torques."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.contact import Contact

Array = NDArray[np.float64]

OBJECT_STATE = 13
"""Position (3), quaternion xyzw (4), linear and angular velocity (3 + 3) of the object."""


class Engine(Protocol):
    """One hand, one object and perhaps a table. Joint arrays are (fingers, links), from the palm to the tip.

    Attributes:
        q: Positions of all joints [rad].
        v: Their velocities [rad/s].
    """

    q: Array
    v: Array

    def place(self, constants: EpisodeConstants, start: Start, q: Array, v: Array) -> None:
        """Puts everything at the start of an episode; nothing of the past remains, to the bit.

        Args:
            constants: Sizes, masses and friction.
            start: Pose and velocity of the cube.
            q: Positions of all joints (fingers, links) [rad].
            v: Their velocities (fingers, links) [rad/s].
        """
        ...

    def set_gravity(self, acceleration: Array) -> None:
        """Sets the world's gravity (3,) [m/s^2]."""
        ...

    def run(self, steps: int, wrench: Array | None, record: bool) -> Array | None:
        """Runs physics steps: control, apply torques, step.

        Args:
            steps: How many.
            wrench: Force and torque on the cube's centre of mass in the world (6,) [N, N m], or None.
            record: Whether to give the cube's states.

        Returns:
            State of the cube before each step and after the last (steps + 1, 13), or None.
        """
        ...

    def cube_state(self) -> Array:
        """Pose and velocity of the cube's centre in the world (13,), see `OBJECT_STATE`."""
        ...

    def gaps(self) -> list[float]:
        """Gaps of the contact points of the last physics step [m], negative where bodies overlap."""
        ...

    def contacts(self) -> list[Contact]:
        """Contacts on the cube and between fingers in the last physics step."""
        ...

    def normal_forces(self) -> Array:
        """Sums of the normal forces on the object of each finger's other links and of its tip (2, fingers) [N]."""
        ...

    def close(self) -> None:
        """Ends the simulation."""
        ...
