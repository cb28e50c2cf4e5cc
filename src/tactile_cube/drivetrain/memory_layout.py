"""Where each number of a plant lies in its one flat memory: a snapshot is a copy, a batch is a stack."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

from tactile_cube.drivetrain.effects.effect import Array, Effect
from tactile_cube.drivetrain.signals import ROWS
from tactile_cube.hand.rigid_body_equations import WORK_COLUMNS

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
    C, N, n, joints = topology.chains, len(topology.parent), len(topology.leader), topology.joints
    keys: list[tuple[Shape, str]] = [
        ((1,), "dt step seen trace_rows trace_offset reading unsure follows"),
        ((1,), "time_constant tendon_stiffness tendon_damping contact_torque_limit weighed"),
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
