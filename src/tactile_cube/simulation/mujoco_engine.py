"""Hand and cube in MuJoCo."""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand import Hand
from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.contact import Contact, named_contact
from tactile_cube.simulation.drive import HandDrive
from tactile_cube.simulation.engine import OBJECT_STATE
from tactile_cube.simulation.mujoco_model import HandSpec, load_mujoco
from tactile_cube.simulation.native_library import MUJOCO_STEPS, find_compiler, native_library
from tactile_cube.simulation.options import Loop, SimulationOptions

Array = NDArray[np.float64]


class MujocoEngine:
    """See `Engine`. Newton's method on soft contacts; rotors are native, tendons are equality constraints."""

    def __init__(self, hand: Hand, options: SimulationOptions, drive: HandDrive) -> None:
        """Describes the bodies; the model comes with each episode."""
        self._mujoco = load_mujoco()
        self._spec = HandSpec(self._mujoco, hand, options, drive)
        self._links = hand.links_per_finger
        self._dofs = self._links * len(hand.fingers)
        self._loop = make_mujoco_loop(options.loop, self._mujoco, drive)

    @property
    def loop(self) -> Literal["c", "python"]:
        """See `Engine`."""
        return self._loop.kind

    @property
    def q(self) -> Array:
        """See `Engine.q`."""
        return np.asarray(self._data.qpos[: self._dofs].reshape(-1, self._links))

    @property
    def v(self) -> Array:
        """See `Engine.v`."""
        return np.asarray(self._data.qvel[: self._dofs].reshape(-1, self._links))

    def place(self, constants: EpisodeConstants, start: Start, q: Array, v: Array) -> None:
        """See `Engine.place`."""
        self._model = self._spec.compile(constants)
        self._data = self._mujoco.MjData(self._model)
        x, y, z, w = np.asarray(start.cube_quaternion)
        turn = Rotation.from_quat(np.array(start.cube_quaternion)).inv()
        self._data.qpos[:] = [*q.ravel(), *np.asarray(start.cube_position), w, x, y, z]
        angular = turn.apply(np.array(start.cube_angular_velocity))
        self._data.qvel[:] = [*v.ravel(), *np.asarray(start.cube_linear_velocity), *angular]
        self._loop.bind(self._model, self._data, self._dofs)

    def set_gravity(self, acceleration: Array) -> None:
        """See `Engine.set_gravity`."""
        self._model.opt.gravity[:] = acceleration

    def run(self, steps: int, wrench: Array | None, record: bool) -> Array | None:
        """See `Engine.run`."""
        self._data.body("cube").xfrc_applied[:] = 0.0 if wrench is None else wrench
        states = np.empty((steps + 1, OBJECT_STATE)) if record else None
        self._loop.run(steps, states)
        return None if states is None else _in_world(states)

    def cube_state(self) -> Array:
        """See `Engine.cube_state`."""
        state = np.concatenate([self._data.qpos[self._dofs :], self._data.qvel[self._dofs :]])
        return _in_world(state[None]).ravel()

    def gaps(self) -> list[float]:
        """See `Engine.gaps`."""
        gaps: list[float] = self._data.contact.dist.tolist()
        return gaps

    def contacts(self) -> list[Contact]:
        """See `Engine.contacts`."""
        return [self._contact(index) for index in range(self._data.ncon)]

    def close(self) -> None:
        """Nothing to end: MuJoCo has no server."""

    def _contact(self, index: int) -> Contact:
        """One contact with names; MuJoCo's force is that on the second shape."""
        contact, wrench = self._data.contact[index], np.zeros(6)
        self._mujoco.mj_contactForce(self._model, self._data, index, wrench)
        frame = np.reshape(contact.frame, (3, 3))
        names = [self._model.geom(shape).name.partition(" ") for shape in contact.geom]
        return named_contact(
            bodies=(names[0][0], names[1][0]),
            links=(names[0][2].partition("#")[0], names[1][2].partition("#")[0]),
            middle=np.array(contact.pos),
            normal=np.array(frame[0]),
            distance=float(contact.dist),
            force=float(wrench[0]),
            friction=wrench[1:3] @ frame[1:],
        )


def _in_world(states: Array) -> Array:
    """Rows of MuJoCo's free joint (n, 13) as `OBJECT_STATE`: quaternion xyzw, angular velocity in the world."""
    quaternion: Any = states[:, [4, 5, 6, 3]]
    angular = Rotation.from_quat(quaternion).apply(states[:, 10:])
    return np.concatenate([states[:, :3], quaternion, states[:, 7:10], angular], axis=1)


class MujocoLoop(Protocol):
    """Runs physics steps of a model and its data."""

    kind: Literal["c", "python"]

    def bind(self, model: Any, data: Any, dofs: int) -> None:
        """Says what the steps work on.

        Args:
            model: MuJoCo's.
            data: MuJoCo's.
            dofs: Joints of all fingers; the cube's free joint follows them.
        """
        ...

    def run(self, steps: int, states: Array | None) -> None:
        """Runs physics steps.

        Args:
            steps: How many.
            states: (steps + 1, 13), filled with the cube's state before each step and after the last, or None.
        """
        ...


def make_mujoco_loop(kind: Loop, mujoco: ModuleType, drive: HandDrive) -> MujocoLoop:
    """The loop of that kind; `auto` takes the compiled one where it can be built."""
    if kind == "python" or (kind == "auto" and find_compiler() is None):
        return PythonMujocoLoop(mujoco, drive)
    try:
        return NativeMujocoLoop(mujoco, drive)
    except (InputError, OSError):
        if kind == "c":
            raise
        return PythonMujocoLoop(mujoco, drive)


class NativeMujocoLoop:
    """All steps in one C call."""

    kind: Literal["c", "python"] = "c"

    def __init__(self, mujoco: ModuleType, drive: HandDrive) -> None:
        """Builds the loop and finds MuJoCo's step."""
        self._library = _load()
        self._step = _address_of_step(mujoco)
        self._control, self._memory = drive.plant.kernel.control_address, drive.memory

    def bind(self, model: Any, data: Any, dofs: int) -> None:
        """See `MujocoLoop.bind`."""
        self._bound = (model, data)  # kept alive: C sees their addresses
        arrays = (data.qpos, data.qvel, data.qfrc_applied, self._memory)
        self._what = (self._step, model._address, data._address)
        self._on = (dofs, self._control, *(array.ctypes.data for array in arrays))

    def run(self, steps: int, states: Array | None) -> None:
        """See `MujocoLoop.run`."""
        record = None if states is None else states.ctypes.data
        self._library.run_mujoco_steps(*self._what, steps, *self._on, record)


class PythonMujocoLoop:
    """The same steps through MuJoCo's Python functions."""

    kind: Literal["c", "python"] = "python"

    def __init__(self, mujoco: ModuleType, drive: HandDrive) -> None:
        """Takes the control step from the drive's plant."""
        self._step = mujoco.mj_step
        self._control, self._memory = drive.plant.kernel.control_step, drive.memory

    def bind(self, model: Any, data: Any, dofs: int) -> None:
        """See `MujocoLoop.bind`."""
        self._model, self._data, self._dofs = model, data, dofs

    def run(self, steps: int, states: Array | None) -> None:
        """See `MujocoLoop.run`."""
        model, data, dofs = self._model, self._data, self._dofs
        joints = (data.qpos[:dofs], data.qvel[:dofs], data.qfrc_applied[:dofs])
        for i in range(steps):
            if states is not None:
                states[i] = self._cube_state()
            self._control(i, *joints, self._memory)
            self._step(model, data)
        if states is not None:
            states[steps] = self._cube_state()

    def _cube_state(self) -> Array:
        return np.concatenate([self._data.qpos[self._dofs :], self._data.qvel[self._dofs :]])


@functools.cache
def _load() -> ctypes.CDLL:
    library = ctypes.CDLL(str(native_library(MUJOCO_STEPS)))
    pointer, number = ctypes.c_void_p, ctypes.c_int64
    library.run_mujoco_steps.restype = None
    library.run_mujoco_steps.argtypes = [*[pointer] * 3, number, number, *[pointer] * 6]
    return library


def _address_of_step(mujoco: ModuleType) -> int:
    """Address of mj_step in the library that the package has loaded."""
    library = next(Path(mujoco.__file__ or "").parent.glob("libmujoco.*"), None)
    if library is None:
        raise InputError("the package mujoco has no libmujoco beside it; choose simulation.loop=python")
    step = ctypes.CDLL(str(library)).mj_step
    return ctypes.cast(step, ctypes.c_void_p).value or 0
