"""Compile the steps for one plant, and keep the machine code on disk for the next process."""

import hashlib
import inspect
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from math import prod
from pathlib import Path
from types import ModuleType

import numba
import numpy as np

from tactile_cube import compiled as decorator
from tactile_cube.drivetrain import laws, signals
from tactile_cube.drivetrain.effects.effect import Effect, Stage
from tactile_cube.drivetrain.signals import ROWS
from tactile_cube.errors import InputError
from tactile_cube.hand import rigid_body_equations
from tactile_cube.hand.rigid_body_equations import WORK_COLUMNS

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Topology:
    """Structure compiled into a kernel: `chains` equal trees, and how their dofs are connected.

    Attributes:
        chains: C, number of fingers.
        parent: (N) index of the parent link, -1 for the base.
        prismatic: (N) 1 where a joint slides.
        follow: (N) actuated joint that each dof follows.
        leader: (n) dof of each actuated joint.
    """

    chains: int
    parent: tuple[int, ...]
    prismatic: tuple[int, ...]
    follow: tuple[int, ...]
    leader: tuple[int, ...]

    @property
    def joints(self) -> int:
        """Actuated joints of all chains."""
        return self.chains * len(self.leader)


@dataclass(frozen=True)
class MemoryLayout:
    """Offset and shape of each key; effect states and the trace come last, so that nothing else moves with dt."""

    entries: dict[str, tuple[int, Shape]]
    size: int


def plan_memory(topology: Topology, effects: Sequence[type[Effect]], dt: float, trace_rows: int) -> MemoryLayout:
    """Lay out the memory for a topology and the effects that may act on its joints."""
    C, N, n, joints = topology.chains, len(topology.parent), len(topology.leader), topology.joints
    keys: list[tuple[Shape, str]] = [
        ((1,), "dt step seen trace_rows trace_offset reading unsure follows"),
        ((1,), "time_constant tendon_stiffness tendon_damping contact_torque_limit needs_weight"),
        # of each joint: constants, then its state
        ((joints,), "kp kd compliance static_friction reflected_inertia torque_limit command_torque_limit rate_limit"),
        ((joints,), "brake friction_creep external_torque angle_offset goal"),
        ((joints,), "q v filtered limited extra extra_compliance held_back contact"),
        ((C, ROWS, n), "signals"),
        # of each chain: its mechanism, then what the last step left
        ((C, 3), "gravity engine_gravity"),
        ((C, N), "ratio offset mass spin_inertia armature last_speed last_torque last_bias"),
        ((C, N, 3), "placement_translation axis com"),
        ((C, N, 3, 3), "placement_rotation inertia"),
        ((C, N, N), "last_mass_matrix"),
        # scratch of one chain at a time
        ((N + 1, WORK_COLUMNS), "work"),
        ((N, N), "mass_matrix"),
        ((N,), "bias weight q_all v_all"),
        ((n, n), "joint_mass_matrix factor"),
        ((n,), "joint_bias momentum friction_impulse grip speed side trial joint_acceleration"),
        ((len(effects),), "state_offset state_size"),
        *(((joints,), f"active:{effect.name}") for effect in effects),
        *(((joints, len(effect.parameters)), f"parameters:{effect.name}") for effect in effects),
        *(((joints, effect.kept(dt)), f"state:{effect.name}") for effect in effects),
        ((trace_rows, C, ROWS, n), "trace"),
    ]
    entries, offset = {}, 0
    for shape, names in keys:
        for key in names.split():
            entries[key] = offset, shape
            offset += prod(shape)
    return MemoryLayout(entries, offset)


_PHYSICS = (decorator, laws, rigid_body_equations, signals)
_STEPS = Path(__file__).parent / "steps"
_ENTRY_POINTS = "entry_points"


def load_kernel(topology: Topology, effects: Sequence[type[Effect]], layout: MemoryLayout) -> ModuleType:
    """Load the compiled steps of a plant, see `steps.entry_points`, as a package of a cache folder and the steps'."""
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
    """Return the directory of compiled kernels: $XDG_CACHE_HOME/tactile_cube, ~/.cache, or the temporary directory."""
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
    """Hash everything that the machine code depends on: any change of a law or a library requires a new file."""
    digest = hashlib.sha256(source.encode())
    for step in sorted(_STEPS.glob("*.py")):
        digest.update(step.read_bytes())
    for module in _PHYSICS:
        digest.update(inspect.getsource(module).encode())
    for effect in effects:
        if effect.__module__ == "__main__" or "<locals>" in effect.__qualname__:
            raise InputError(
                f"effect '{effect.__qualname__}' must stand at the top of a file of its own, to be imported"
            )
        digest.update(inspect.getsource(sys.modules[effect.__module__]).encode())
    digest.update(f"{numba.__version__} {np.__version__} {sys.version}".encode())
    return digest.hexdigest()[:20]


def _write_once(path: Path, source: str) -> None:
    """Write a file that other processes may be writing too: all write the same, the last one replaces the others."""
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
    """Return the text of a module with C, N, n, the topology, the memory's offsets and a function for each stage."""
    laws = [
        f'{law}_{index} = compiled(import_module("{effect.__module__}").{effect.__qualname__}.{law})'
        for index, effect in enumerate(effects)
        for law in ("law", "torque_law", "ahead_law")
        if effect.defines(law)
    ]
    stages = [_stage(stage, effects, layout) for stage in Stage if stage.value >= 0]
    return _HEADER + "\n".join([*_constants(topology, layout), *laws, *stages, _ahead(effects, layout)])


def _constants(topology: Topology, layout: MemoryLayout) -> list[str]:
    indices = ("parent", "prismatic", "follow", "leader")
    offsets = {key: offset for key, (offset, _) in layout.entries.items() if ":" not in key and key != "trace"}
    return [
        f"C, N, n = {topology.chains}, {len(topology.parent)}, {len(topology.leader)}",
        *(f"{name.upper()} = np.array({list(getattr(topology, name))}, dtype=np.int64)" for name in indices),
        *(f"{key.upper()} = {offset}" for key, offset in offsets.items()),
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
    """Return the sensor laws that are known before the torque: those without memory, or made for it."""
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
