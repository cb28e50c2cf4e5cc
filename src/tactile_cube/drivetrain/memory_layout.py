"""Where each number of a plant lies in its one flat memory: a snapshot is a copy, a batch is a stack."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

import numpy as np
import numpy.typing as npt

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.signals import ROWS
from tactile_cube.hand.rigid_body_equations import WORK_COLUMNS

Array = npt.NDArray[np.float64]
Shape = tuple[int, ...]


@dataclass(frozen=True)
class Topology:
    """What is compiled into a kernel: `chains` equal trees and how their dofs hang together.

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

    @property
    def dofs(self) -> int:
        """All degrees of freedom of all chains."""
        return self.chains * len(self.parent)


@dataclass(frozen=True)
class MemoryLayout:
    """Offset and shape of each key; effect states and the trace come last, so that nothing else moves with dt."""

    entries: dict[str, tuple[int, Shape]]
    size: int

    def view(self, memory: Array, key: str) -> Array:
        """A writable view (..., shape) of a key in memory (..., size).

        Raises:
            KeyError: no such key.
        """
        offset, shape = self.entries[key]
        part = memory[..., offset : offset + prod(shape)]
        part.shape = memory.shape[:-1] + shape  # never a copy
        return part


def plan_memory(topology: Topology, effects: Sequence[type[Effect]], dt: float, trace_rows: int) -> MemoryLayout:
    """The layout for a topology and the effects that may act on its joints."""
    shapes = {
        **dict.fromkeys(("size", "dt", "step", "seen", "trace_rows", "trace_offset", "reading", "unsure"), (1,)),
        **_joint_constants(topology.joints),
        **_mechanism(topology.chains, len(topology.parent)),
        **_state(topology),
        **_scratch(len(topology.parent), len(topology.leader)),
        **_effects(topology.joints, effects),
    }
    shapes |= {f"state:{e.name}": (topology.joints, e.kept(dt)) for e in effects}
    shapes["trace"] = (trace_rows, topology.chains, ROWS, len(topology.leader))
    entries, offset = {}, 0
    for key, shape in shapes.items():
        entries[key] = offset, shape
        offset += prod(shape)
    return MemoryLayout(entries, offset)


def _joint_constants(joints: int) -> dict[str, Shape]:
    per_joint = (
        "kp",
        "kd",
        "compliance",
        "static_friction",
        "reflected_inertia",
        "torque_limit",
        "command_torque_limit",
        "rate_limit",
        "brake",
        "friction_creep",
        "external_torque",
        "angle_offset",
        "goal",
    )
    single = ("time_constant", "tendon_stiffness", "tendon_damping", "contact_torque_limit", "weighed")
    return {**dict.fromkeys(per_joint, (joints,)), **dict.fromkeys(single, (1,))}


def _mechanism(chains: int, dofs: int) -> dict[str, Shape]:
    return {
        "gravity": (chains, 3),
        "engine_gravity": (chains, 3),
        "ratio": (chains, dofs),
        "offset": (chains, dofs),
        "placement_rotation": (chains, dofs, 3, 3),
        "placement_translation": (chains, dofs, 3),
        "axis": (chains, dofs, 3),
        "mass": (chains, dofs),
        "com": (chains, dofs, 3),
        "inertia": (chains, dofs, 3, 3),
        "spin_inertia": (chains, dofs),
        "armature": (chains, dofs),
    }


def _state(topology: Topology) -> dict[str, Shape]:
    joints, chains, dofs = topology.joints, topology.chains, len(topology.parent)
    return {
        **{
            key: (joints,)
            for key in ("q", "v", "filtered", "limited", "extra", "extra_compliance", "held_back", "contact")
        },
        "signals": (chains, ROWS, len(topology.leader)),
        "last_speed": (chains, dofs),
        "last_torque": (chains, dofs),
        "last_bias": (chains, dofs),
        "last_mass_matrix": (chains, dofs, dofs),
    }


def _scratch(dofs: int, joints: int) -> dict[str, Shape]:
    return {
        "work": (dofs + 1, WORK_COLUMNS),
        "mass_matrix": (dofs, dofs),
        "bias": (dofs,),
        "weight": (dofs,),
        "q_all": (dofs,),
        "v_all": (dofs,),
        "joint_mass_matrix": (joints, joints),
        "joint_bias": (joints,),
        "factor": (joints, joints),
        "momentum": (joints,),
        "friction_impulse": (joints,),
        "grip": (joints,),
        "speed": (joints,),
        "side": (joints,),
        "trial": (joints,),
        "joint_acceleration": (joints,),
    }


def _effects(joints: int, effects: Sequence[type[Effect]]) -> dict[str, Shape]:
    shapes: dict[str, Shape] = {"state_offset": (len(effects),), "state_size": (len(effects),)}
    for effect in effects:
        shapes[f"active:{effect.name}"] = (joints,)
        shapes[f"parameters:{effect.name}"] = (joints, len(effect.parameters))
    return shapes
