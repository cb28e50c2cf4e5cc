"""The physics steps of one policy step in MuJoCo; from Python or in one compiled call, with the same bits."""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.simulation.drive import HandDrive
from tactile_cube.simulation.native_library import MUJOCO_STEPS, find_compiler, native_library
from tactile_cube.simulation.options import Loop

Array = NDArray[np.float64]


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
