"""Hand and cube in PyBullet."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pybullet
from numpy.typing import NDArray

from tactile_cube.hand import Hand
from tactile_cube.simulation.bullet_bodies import BulletBodies, com_arm
from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.contact import Contact
from tactile_cube.simulation.drive import HandDrive
from tactile_cube.simulation.engine import OBJECT_STATE
from tactile_cube.simulation.loop import make_loop
from tactile_cube.simulation.options import SimulationOptions

Array = NDArray[np.float64]


class BulletEngine:
    """See `Engine`. Sequential impulses; rotors and tendons are worked into the torques, see `spin_inertia`."""

    def __init__(self, hand: Hand, options: SimulationOptions, drive: HandDrive) -> None:
        """Builds the bodies and binds the drive's memory to the loop."""
        self._drive = drive
        self._bodies = BulletBodies(hand, options, drive.finger_urdfs())
        self._joints = np.zeros((2, len(hand.fingers), hand.links_per_finger))
        self._loop = make_loop(options.loop, self._bodies.client, drive.plant)
        q, v = self._joints.reshape(2, -1)
        self._loop.bind(self._bodies.fingers, q, v, drive.memory)

    @property
    def loop(self) -> Literal["c", "python"]:
        """See `Engine`."""
        return self._loop.kind

    @property
    def q(self) -> Array:
        """See `Engine.q`."""
        return np.asarray(self._joints[0])

    @property
    def v(self) -> Array:
        """See `Engine.v`."""
        return np.asarray(self._joints[1])

    def place(self, constants: EpisodeConstants, start: Start, q: Array, v: Array) -> None:
        """See `Engine.place`."""
        self._constants = constants
        self._joints[0], self._joints[1] = q, v
        self._bodies.place(constants, start, q, v)
        self._bodies.set_spin_inertia(self._drive.view("spin_inertia"))

    def set_gravity(self, acceleration: Array) -> None:
        """See `Engine.set_gravity`."""
        self._bodies.set_gravity(acceleration)

    def run(self, steps: int, wrench: Array | None, record: bool) -> Array | None:
        """See `Engine.run`."""
        states = np.empty((steps + 1, OBJECT_STATE)) if record else None
        self._loop.run(steps, self._bodies.cube, wrench, states)
        return None if states is None else np.stack([self._of_centre(state) for state in states])

    def cube_state(self) -> Array:
        """See `Engine.cube_state`."""
        client, cube = self._bodies.client, self._bodies.cube
        position, quaternion = pybullet.getBasePositionAndOrientation(cube, physicsClientId=client)
        linear, angular = pybullet.getBaseVelocity(cube, physicsClientId=client)
        return self._of_centre(np.array([*position, *quaternion, *linear, *angular]))

    def gaps(self) -> list[float]:
        """See `Engine.gaps`."""
        return [row[8] for row in pybullet.getContactPoints(physicsClientId=self._bodies.client)]

    def contacts(self) -> list[Contact]:
        """See `Engine.contacts`."""
        return self._bodies.contacts()

    def close(self) -> None:
        """Ends the physics server."""
        self._bodies.close()

    def _of_centre(self, state: Array) -> Array:
        """Bullet speaks of the centre of mass; the same state (13,) of the cube's centre."""
        if np.asarray(self._constants.cube_com).any():
            arm = com_arm(self._constants, state[3:7])
            state[:3] -= arm
            state[7:10] -= np.cross(state[10:13], arm)
        return state
