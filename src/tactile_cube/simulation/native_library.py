"""The compiled loops over physics steps: built once with the system's C compiler, kept in the user's cache."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import pybullet

from tactile_cube.drivetrain.kernel import cache_directory
from tactile_cube.errors import InputError

_FOLDER = Path(__file__).parent / "native"
BULLET_STEPS, MUJOCO_STEPS = "physics_steps", "mujoco_steps"
_FLAGS = ("-O2", "-shared", "-fPIC", "-ffp-contract=off")


def find_compiler() -> str | None:
    """Path of the system's C compiler ($CC, cc, gcc or clang), or None."""
    for name in (os.environ.get("CC"), "cc", "gcc", "clang"):
        if name and (path := shutil.which(name)):
            return path
    return None


@functools.cache
def native_library(name: str = BULLET_STEPS) -> Path:
    """The shared library of a source, compiled now if it never was; several processes may ask at once.

    Raises:
        InputError: No compiler was found, or it failed.
    """
    source = _FOLDER / f"{name}.c"
    digest = hashlib.sha256(source.read_bytes() + " ".join(_FLAGS).encode()).hexdigest()[:16]
    library = cache_directory() / f"{name}-{digest}.so"
    if not library.exists():
        _compile(source, library)
    return library


def _compile(source: Path, library: Path) -> None:
    """Compiles beside the target and renames, so that no process ever sees half a library."""
    compiler = find_compiler()
    if compiler is None:
        raise InputError("simulation.loop=c needs a C compiler (cc); install one or choose simulation.loop=python")
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        fresh = Path(folder) / library.name
        command = [compiler, *_FLAGS, "-o", str(fresh), str(source)]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        if result.returncode != 0:
            raise InputError(f"{' '.join(command)} failed: {result.stderr.strip()}; choose simulation.loop=python")
        fresh.replace(library)


@functools.cache
def load_native() -> ctypes.CDLL:
    """The library for PyBullet, with PyBullet's exported functions made visible to it first."""
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
