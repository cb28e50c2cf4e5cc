"""Hand and cube in PyBullet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol

import numpy as np
import pybullet
from numpy.typing import NDArray

from tactile_cube.drivetrain import Plant
from tactile_cube.errors import InputError
from tactile_cube.hand import Hand
from tactile_cube.simulation.bullet_bodies import BulletBodies, com_arm
from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.contact import Contact
from tactile_cube.simulation.drive import HandDrive
from tactile_cube.simulation.engine import OBJECT_STATE
from tactile_cube.simulation.native_library import find_compiler, load_native, native_library
from tactile_cube.simulation.options import Loop, SimulationOptions

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


class PhysicsLoop(Protocol):
    """Runs physics steps of bound arrays; both implementations give the same bits."""

    kind: Literal["c", "python"]

    def bind(self, chains: Sequence[int], q: Array, v: Array, memory: Array) -> None:
        """Says what the steps work on, in place.

        Args:
            chains: Body ids of the chains.
            q: Positions of all joints of all chains, current before and after each run [rad].
            v: Velocities, likewise [rad/s].
            memory: The drivetrain's memory.
        """
        ...

    def run(self, steps: int, cube: int, wrench: Array | None, states: Array | None) -> None:
        """Runs physics steps.

        Args:
            steps: How many.
            cube: Body id of the object; needed where `wrench` or `states` is given.
            wrench: Force and torque on the object's centre (6,) [N, N m], or None.
            states: (steps + 1, 13), filled with the object's state before each step and after the last, or None.
        """
        ...


def make_loop(kind: Loop, client: int, plant: Plant) -> PhysicsLoop:
    """The loop of that kind; `auto` takes the compiled one where it can be built."""
    if kind == "python" or (kind == "auto" and find_compiler() is None):
        return PythonLoop(client, plant)
    try:
        return NativeLoop(client, plant)
    except (InputError, OSError):
        if kind == "c":
            raise
        return PythonLoop(client, plant)


class NativeLoop:
    """All steps in one C call inside PyBullet's process."""

    kind: Literal["c", "python"] = "c"

    def __init__(self, client: int, plant: Plant) -> None:
        """Attaches the compiled loop to a client as a PyBullet plugin; once for each client."""
        self._library = load_native()
        if pybullet.loadPlugin(str(native_library()), "_steps", physicsClientId=client) < 0:
            raise InputError("PyBullet refused the compiled loop; choose simulation.loop=python")
        self._handle = self._library.physics_client()
        self._control = plant.kernel.control_address

    def bind(self, chains: Sequence[int], q: Array, v: Array, memory: Array) -> None:
        """See `PhysicsLoop.bind`."""
        self._chains = np.array(chains, dtype=np.int32)
        self._bound = (q, v, np.zeros_like(q), memory)  # kept alive: C sees their addresses
        self._who = (self._handle, self._chains.ctypes.data, len(chains), q.size // len(chains))
        self._what = (self._control, *(array.ctypes.data for array in self._bound))

    def run(self, steps: int, cube: int, wrench: Array | None, states: Array | None) -> None:
        """See `PhysicsLoop.run`."""
        if wrench is not None and states is None:
            states = np.empty((steps + 1, OBJECT_STATE))
        push, record = (None if array is None else array.ctypes.data for array in (wrench, states))
        self._library.run_physics_steps(*self._who, steps, *self._what, cube, push, record)


class PythonLoop:
    """The same steps through PyBullet's Python functions."""

    kind: Literal["c", "python"] = "python"

    def __init__(self, client: int, plant: Plant) -> None:
        """Takes the control step from the plant."""
        self._client = client
        self._control = plant.kernel.control_step

    def bind(self, chains: Sequence[int], q: Array, v: Array, memory: Array) -> None:
        """See `PhysicsLoop.bind`."""
        self._chains = list(chains)
        self._q, self._v, self._memory = q, v, memory

    def run(self, steps: int, cube: int, wrench: Array | None, states: Array | None) -> None:
        """See `PhysicsLoop.run`."""
        torque = np.zeros_like(self._q)
        for i in range(steps):
            self._control(i, self._q, self._v, torque, self._memory)
            self._apply(torque)
            if states is not None:
                states[i] = self._object_state(cube)
            if wrench is not None:
                self._push(cube, wrench)
            pybullet.stepSimulation(physicsClientId=self._client)
            self._read(self._q, self._v)
        if states is not None:
            states[steps] = self._object_state(cube)

    def _apply(self, torque: Array) -> None:
        joints = range(torque.size // len(self._chains))
        for body, forces in zip(self._chains, torque.reshape(len(self._chains), -1).tolist(), strict=True):
            pybullet.setJointMotorControlArray(
                body, joints, pybullet.TORQUE_CONTROL, forces=forces, physicsClientId=self._client
            )

    def _read(self, q: Array, v: Array) -> None:
        joints = range(q.size // len(self._chains))
        for c, body in enumerate(self._chains):
            states = pybullet.getJointStates(body, joints, physicsClientId=self._client)
            here = slice(c * len(joints), (c + 1) * len(joints))
            q[here], v[here] = [state[0] for state in states], [state[1] for state in states]

    def _object_state(self, cube: int) -> Array:
        position, quaternion = pybullet.getBasePositionAndOrientation(cube, physicsClientId=self._client)
        linear, angular = pybullet.getBaseVelocity(cube, physicsClientId=self._client)
        return np.array([*position, *quaternion, *linear, *angular])

    def _push(self, cube: int, wrench: Array) -> None:
        centre, _ = pybullet.getBasePositionAndOrientation(cube, physicsClientId=self._client)
        frame = pybullet.WORLD_FRAME
        pybullet.applyExternalForce(cube, -1, wrench[:3].tolist(), centre, frame, physicsClientId=self._client)
        pybullet.applyExternalTorque(cube, -1, wrench[3:].tolist(), frame, physicsClientId=self._client)
