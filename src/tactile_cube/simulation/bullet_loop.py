"""The physics steps of a policy step in PyBullet: in C where a compiler is found, else in Python, to the same bits."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pybullet
from numpy.typing import NDArray

from tactile_cube.drivetrain import Plant
from tactile_cube.drivetrain.kernel import cache_directory
from tactile_cube.simulation.engine import OBJECT_STATE

Array = NDArray[np.float64]

_SOURCE = Path(__file__).parent / "native" / "physics_steps.c"
_FLAGS = ("-O2", "-shared", "-fPIC", "-ffp-contract=off")


def make_loop(client: int, plant: Plant) -> NativeLoop | PythonLoop:
    """The compiled loop if it can be built, else the one in Python, which takes twice the time."""
    try:
        return NativeLoop(client, plant)
    except OSError:
        return PythonLoop(client, plant)


class NativeLoop:
    """All steps in one C call inside PyBullet's process."""

    def __init__(self, client: int, plant: Plant) -> None:
        """Attaches the compiled loop to a client as a PyBullet plugin; once for each client.

        Raises:
            OSError: There is no compiler, it failed, or PyBullet refused the plugin.
        """
        self._library = load_native()
        if pybullet.loadPlugin(str(native_library()), "_steps", physicsClientId=client) < 0:
            raise OSError("PyBullet refused the compiled loop")
        self._handle = self._library.physics_client()
        self._control = plant.kernel.control_callback()[1]

    def bind(self, chains: Sequence[int], q: Array, v: Array, memory: Array) -> None:
        """Says what the steps work on, in place.

        Args:
            chains: Body ids of the chains.
            q: Positions of all joints of all chains, current before and after each run [rad].
            v: Velocities, likewise [rad/s].
            memory: The drivetrain's memory.
        """
        self._chains = np.array(chains, dtype=np.int32)
        self._bound = (q, v, np.zeros_like(q), memory)  # kept alive: C sees their addresses
        self._who = (self._handle, self._chains.ctypes.data, len(chains), q.size // len(chains))
        self._what = (self._control, *(array.ctypes.data for array in self._bound))

    def run(self, steps: int, cube: int = -1, wrench: Array | None = None, states: Array | None = None) -> None:
        """Runs physics steps.

        Args:
            steps: How many.
            cube: Body id of the object; needed where `wrench` or `states` is given.
            wrench: Force and torque on the object's centre (6,) [N, N m], or None.
            states: (steps + 1, 13), filled with the object's state before each step and after the last, or None.
        """
        if wrench is not None and states is None:
            states = np.empty((steps + 1, OBJECT_STATE))
        push, record = (None if array is None else array.ctypes.data for array in (wrench, states))
        self._library.run_physics_steps(*self._who, steps, *self._what, cube, push, record)


class PythonLoop:
    """The same steps through PyBullet's Python functions."""

    def __init__(self, client: int, plant: Plant) -> None:
        """Takes the control step from the plant."""
        self._client = client
        self._control = plant.kernel.control_step

    def bind(self, chains: Sequence[int], q: Array, v: Array, memory: Array) -> None:
        """See `NativeLoop.bind`."""
        self._chains = list(chains)
        self._q, self._v, self._memory = q, v, memory

    def run(self, steps: int, cube: int = -1, wrench: Array | None = None, states: Array | None = None) -> None:
        """See `NativeLoop.run`."""
        torque = np.zeros_like(self._q)
        for i in range(steps):
            self._control(i, self._q, self._v, torque, self._memory)
            self._apply(torque)
            if states is not None:
                states[i] = object_state(self._client, cube)
            if wrench is not None:
                self._push(cube, wrench)
            pybullet.stepSimulation(physicsClientId=self._client)
            self._read()
        if states is not None:
            states[steps] = object_state(self._client, cube)

    def _apply(self, torque: Array) -> None:
        joints = range(torque.size // len(self._chains))
        for body, forces in zip(self._chains, torque.reshape(len(self._chains), -1).tolist(), strict=True):
            pybullet.setJointMotorControlArray(
                body, joints, pybullet.TORQUE_CONTROL, forces=forces, physicsClientId=self._client
            )

    def _read(self) -> None:
        joints = range(self._q.size // len(self._chains))
        for c, body in enumerate(self._chains):
            states = pybullet.getJointStates(body, joints, physicsClientId=self._client)
            here = slice(c * len(joints), (c + 1) * len(joints))
            self._q[here], self._v[here] = [state[0] for state in states], [state[1] for state in states]

    def _push(self, cube: int, wrench: Array) -> None:
        centre, _ = pybullet.getBasePositionAndOrientation(cube, physicsClientId=self._client)
        frame = pybullet.WORLD_FRAME
        pybullet.applyExternalForce(cube, -1, wrench[:3].tolist(), centre, frame, physicsClientId=self._client)
        pybullet.applyExternalTorque(cube, -1, wrench[3:].tolist(), frame, physicsClientId=self._client)


def object_state(client: int, body: int) -> Array:
    """Pose and velocity of a body's centre of mass (13,), see `OBJECT_STATE`."""
    position, quaternion = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    linear, angular = pybullet.getBaseVelocity(body, physicsClientId=client)
    return np.array([*position, *quaternion, *linear, *angular])


def find_compiler() -> str | None:
    """Path of the system's C compiler ($CC, cc, gcc or clang), or None."""
    names = (os.environ.get("CC"), "cc", "gcc", "clang")
    return next((path for name in names if name and (path := shutil.which(name))), None)


@functools.cache
def native_library() -> Path:
    """The shared library of the loop in the user's cache, compiled now if it never was.

    Raises:
        OSError: No compiler was found, or it failed.
    """
    digest = hashlib.sha256(_SOURCE.read_bytes() + " ".join(_FLAGS).encode()).hexdigest()[:16]
    library = cache_directory() / f"{_SOURCE.stem}-{digest}.so"
    if library.exists():
        return library
    compiler = find_compiler()
    if compiler is None:
        raise OSError("no C compiler")
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:  # renamed: no process sees half a library
        fresh = Path(folder) / library.name
        command = [compiler, *_FLAGS, "-o", str(fresh), str(_SOURCE)]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        if result.returncode != 0:
            raise OSError(f"{' '.join(command)} failed: {result.stderr.strip()}")
        fresh.replace(library)
    return library


@functools.cache
def load_native() -> ctypes.CDLL:
    """The library, with PyBullet's exported functions made visible to it first."""
    ctypes.CDLL(pybullet.__file__, mode=ctypes.RTLD_GLOBAL)
    library = ctypes.CDLL(str(native_library()))
    pointer, number = ctypes.c_void_p, ctypes.c_int
    library.physics_client.restype = pointer
    library.run_physics_steps.restype = None
    library.run_physics_steps.argtypes = [
        *(pointer, pointer, number, number, ctypes.c_int64),
        *(pointer, pointer, pointer, pointer, pointer),
        *(number, pointer, pointer),
    ]
    return library
