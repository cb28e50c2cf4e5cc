"""The physics steps of one policy step: control, apply torques, step, read; from Python or in one compiled call."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Literal, Protocol

import numpy as np
import pybullet
from numpy.typing import NDArray

from tactile_cube.drivetrain import Plant
from tactile_cube.errors import InputError
from tactile_cube.simulation.native_library import find_compiler, load_native, native_library
from tactile_cube.simulation.options import Loop

Array = NDArray[np.float64]

OBJECT_STATE = 13
"""Position (3), quaternion xyzw (4), linear and angular velocity (3 + 3) of the object."""


class PhysicsLoop(Protocol):
    """Runs physics steps; both implementations give the same bits."""

    kind: Literal["c", "python"]

    def run(
        self, steps: int, q: Array, v: Array, memory: Array, cube: int, wrench: Array | None, states: Array | None
    ) -> None:
        """Runs `steps` physics steps.

        Args:
            steps: How many.
            q: Positions of all joints of all chains, updated in place [rad].
            v: Velocities, likewise [rad/s].
            memory: The drivetrain's memory.
            cube: Body id of the object; needed where `wrench` or `states` is given.
            wrench: Force and torque on the object's centre (6,) [N, N m], or None.
            states: (steps + 1, 13), filled with the object's state before each step and after the last, or None.
        """
        ...


def make_loop(kind: Loop, client: int, chains: Sequence[int], plant: Plant) -> PhysicsLoop:
    """The loop of that kind; `auto` takes the compiled one where it can be built."""
    if kind == "python":
        return PythonLoop(client, chains, plant)
    if kind == "c":
        return NativeLoop(client, chains, plant)
    if find_compiler() is None:
        return PythonLoop(client, chains, plant)
    try:
        return NativeLoop(client, chains, plant)
    except (InputError, OSError):
        return PythonLoop(client, chains, plant)


class NativeLoop:
    """All steps in one C call inside PyBullet's process."""

    kind: Literal["c", "python"] = "c"

    def __init__(self, client: int, chains: Sequence[int], plant: Plant) -> None:
        """Attaches the compiled loop to a client as a PyBullet plugin."""
        self._library = load_native()
        if pybullet.loadPlugin(str(native_library()), "_steps", physicsClientId=client) < 0:
            raise InputError("PyBullet refused the compiled loop; choose simulation.loop=python")
        self._handle = ctypes.c_void_p(self._library.physics_client())
        self._chains = np.array(chains, dtype=np.int32)
        self._control = ctypes.c_void_p(plant.kernel.control_address)

    def run(
        self, steps: int, q: Array, v: Array, memory: Array, cube: int, wrench: Array | None, states: Array | None
    ) -> None:
        """See `PhysicsLoop.run`."""
        if wrench is not None and states is None:
            states = np.empty((steps + 1, OBJECT_STATE))
        torque = np.zeros_like(q)
        n_chains = len(self._chains)
        self._library.run_physics_steps(
            self._handle,
            _pointer(self._chains),
            ctypes.c_int(n_chains),
            ctypes.c_int(q.size // n_chains),
            ctypes.c_int64(steps),
            self._control,
            _pointer(q),
            _pointer(v),
            _pointer(torque),
            _pointer(memory),
            ctypes.c_int(cube),
            _pointer(wrench),
            _pointer(states),
        )


class PythonLoop:
    """The same steps through PyBullet's Python functions."""

    kind: Literal["c", "python"] = "python"

    def __init__(self, client: int, chains: Sequence[int], plant: Plant) -> None:
        """Remembers whom to drive."""
        self._client = client
        self._chains = list(chains)
        self._control = plant.kernel.control_step

    def run(
        self, steps: int, q: Array, v: Array, memory: Array, cube: int, wrench: Array | None, states: Array | None
    ) -> None:
        """See `PhysicsLoop.run`."""
        torque = np.zeros_like(q)
        for i in range(steps):
            self._control(i, q, v, torque, memory)
            self._apply(torque)
            if states is not None:
                states[i] = self._object_state(cube)
            if wrench is not None:
                self._push(cube, wrench)
            pybullet.stepSimulation(physicsClientId=self._client)
            self._read(q, v)
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


def _pointer(array: NDArray[np.generic] | None) -> ctypes.c_void_p:
    return ctypes.c_void_p(None if array is None else array.ctypes.data)
