"""Turns the steps into machine code for one plant, kept on disk so that the next process starts at once."""

from __future__ import annotations

import hashlib
import inspect
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numba
import numpy as np

from tactile_cube import compiled as decorator
from tactile_cube.drivetrain import control_law, coupled_joints, dry_friction, signals
from tactile_cube.drivetrain.effects.effect import Effect, Stage
from tactile_cube.drivetrain.memory_layout import MemoryLayout, Topology
from tactile_cube.errors import InputError
from tactile_cube.hand import rigid_body_equations

_PHYSICS = (control_law, coupled_joints, decorator, dry_friction, rigid_body_equations, signals)
_STEPS = Path(__file__).parent / "steps"
_ENTRY_POINTS = "entry_points"


class Kernel:
    """The compiled steps of a plant; all are Numba functions that can be called inside other compiled code.

    Attributes:
        control_step: (i, q (D,), v (D,), torque_out (D,), memory): torques for PyBullet.
        step: (command (n,), memory): one step of the mechanism without contacts.
        rollout: (commands (H + T, n), H, substeps, memory, rows (R,), out (T, R, n)): signals of each command row.
        rollout_batch: (commands (S, L, n), which (B,), lengths (S,), H, substeps, memory (B, size), rows (R,),
            out (B, T, R, n)).
        segments_batch: as rollout_batch, started anew from measured states every `segment` rows (multiple shooting).
        starts_batch: puts each memory where segments_batch begins.
    """

    def __init__(self, topology: Topology, effects: Sequence[type[Effect]], layout: MemoryLayout) -> None:
        self._module = load_kernel(topology, effects, layout)
        self.control_step: Callable[..., None] = self._module.control_step
        self.step: Callable[..., None] = self._module.step
        self.rollout: Callable[..., None] = self._module.rollout
        self.rollout_batch: Callable[..., None] = self._module.rollout_batch
        self.segments_batch: Callable[..., None] = self._module.segments_batch
        self.starts_batch: Callable[..., None] = self._module.starts_batch

    @cached_property
    def _callback(self) -> tuple[object, int]:
        made: tuple[object, int] = self._module.control_callback()
        return made

    @property
    def control_address(self) -> int:
        """Address of the control step as void(int64 i, double *q, double *v, double *torque, double *memory)."""
        return self._callback[1]


def load_kernel(topology: Topology, effects: Sequence[type[Effect]], layout: MemoryLayout) -> ModuleType:
    """The entry points of the steps for a plant, in a package of its own: a folder in the cache, and the steps' own."""
    plant = kernel_source(topology, effects, layout)
    name = "kernel_" + _fingerprint(plant, effects)
    if name not in sys.modules:
        folder = cache_directory() / name
        folder.mkdir(exist_ok=True)
        _write_once(folder / "plant.py", plant)
        _write_once(folder / f"{_ENTRY_POINTS}.py", (_STEPS / f"{_ENTRY_POINTS}.py").read_text(encoding="utf-8"))
        package = ModuleType(name, "The steps of one plant.")
        package.__path__ = [str(folder), str(_STEPS)]
        sys.modules[name] = package
    return import_module(f"{name}.{_ENTRY_POINTS}")


def cache_directory() -> Path:
    """Where compiled kernels are kept: $XDG_CACHE_HOME/tactile_cube, ~/.cache, or the temporary directory."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    for root in (Path(home), Path(tempfile.gettempdir()) / f"cache-{os.getuid()}"):
        folder = root / "tactile_cube"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    raise InputError("no writable directory for compiled kernels; set XDG_CACHE_HOME to one")


def _fingerprint(source: str, effects: Sequence[type[Effect]]) -> str:
    """Of everything that the machine code depends on: any change of a law or a library asks for a new file."""
    digest = hashlib.sha256(source.encode())
    for step in sorted(_STEPS.glob("*.py")):
        digest.update(step.read_bytes())
    for module in _PHYSICS:
        digest.update(inspect.getsource(module).encode())
    for effect in effects:
        digest.update(_source_of(effect).encode())
    digest.update(f"{numba.__version__} {np.__version__} {sys.version}".encode())
    return digest.hexdigest()[:20]


def _source_of(effect: type[Effect]) -> str:
    module = sys.modules[effect.__module__]
    if effect.__module__ == "__main__" or "<locals>" in effect.__qualname__:
        raise InputError(f"effect '{effect.__qualname__}' must stand at the top of a file of its own, to be imported")
    return inspect.getsource(module)


def _write_once(path: Path, source: str) -> None:
    """Writes a file that other processes may be writing too: all write the same, the last one replaces the others."""
    if not path.exists():
        handle, draft = tempfile.mkstemp(dir=path.parent, suffix=".py")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(source)
        os.utime(draft, (0, 0))  # Numba tells versions of a file apart by its time: equal files, equal time
        os.replace(draft, path)


ANY_STEP = 1e-3  # [s]; whether a law remembers anything does not depend on it

_HEADER = '''"""Generated by tactile_cube.drivetrain.kernel; do not edit."""

from importlib import import_module

import numpy as np

from tactile_cube.compiled import compiled

'''


def kernel_source(topology: Topology, effects: Sequence[type[Effect]], layout: MemoryLayout) -> str:
    """Text of a module with C, N, n, the topology, the offsets into the memory and a function for each stage."""
    stages = [_stage(stage, effects, layout) for stage in Stage if stage is not Stage.MECHANISM]
    return _HEADER + "\n".join([*_constants(topology, layout), *_laws(effects), *stages, _ahead(effects, layout)])


def _constants(topology: Topology, layout: MemoryLayout) -> list[str]:
    sizes = f"C, N, n = {topology.chains}, {len(topology.parent)}, {len(topology.leader)}"
    indices = ("parent", "prismatic", "follow", "leader")
    offsets = {key: offset for key, (offset, _) in layout.entries.items() if ":" not in key and key != "trace"}
    return [
        sizes,
        *(f"{name.upper()} = np.array({list(getattr(topology, name))}, dtype=np.int64)" for name in indices),
        *(f"{key.upper()} = {offset}" for key, offset in offsets.items()),
    ]


def _laws(effects: Sequence[type[Effect]]) -> list[str]:
    return [
        f'{law}_{index} = compiled(import_module("{effect.__module__}").{effect.__qualname__}.{law})'
        for index, effect in enumerate(effects)
        for law in ("law", "torque_law", "ahead_law")
        if effect.defines(law)
    ]


def _stage(stage: Stage, effects: Sequence[type[Effect]], layout: MemoryLayout) -> str:
    lines = []
    for index, effect in enumerate(effects):
        if effect.stage is stage:
            lines += _call(index, effect, layout)
        if stage is Stage.MOTOR_TORQUE and effect.defines("torque_law"):
            lines += _call(index, effect, layout, "torque_law", Stage.MOTOR_TORQUE)
        if stage is Stage.POSITION_SENSOR and effect.stage is not stage and effect.defines("ahead_law"):
            lines += _call(index, effect, layout, "ahead_law", stage)
    return _function(stage.name.lower(), lines)


def _ahead(effects: Sequence[type[Effect]], layout: MemoryLayout) -> str:
    """Laws of the position sensor that can be asked before the torque is known: remembering nothing, or made for it."""
    lines = []
    for index, effect in enumerate(effects):
        if effect.defines("ahead_law"):
            lines += _call(index, effect, layout, "ahead_law", Stage.POSITION_SENSOR)
        elif effect.stage is Stage.POSITION_SENSOR and effect.kept(ANY_STEP) == 0:
            lines += _call(index, effect, layout)
    return _function("position_sensor_ahead", lines)


def _function(name: str, lines: Sequence[str]) -> str:
    return "\n".join(["", "@compiled", f"def effects_{name}(x, c, dt, memory):", *lines, "    return", ""])


def _call(
    index: int, effect: type[Effect], layout: MemoryLayout, law: str = "law", stage: Stage | None = None
) -> list[str]:
    active, parameters = (layout.entries[f"{part}:{effect.name}"][0] for part in ("active", "parameters"))
    count = len(effect.parameters)
    return [
        "    for j in range(n):",
        "        a = c * n + j",
        f"        if memory[{active} + a] != 0.0:",
        f"            size = int(memory[STATE_SIZE + {index}])",
        f"            start = int(memory[STATE_OFFSET + {index}]) + a * size",
        f"            p = memory[{parameters} + a * {count} : {parameters} + (a + 1) * {count}]",
        f"            x[{(stage or effect.stage).value}, j] = {law}_{index}(x, j, p, memory[start : start + size], dt)",
    ]
