"""The drivetrain's constants, and the plant: equal chains of joints whose numbers lie in one flat memory."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import product
from math import prod
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh

from tactile_cube.drivetrain.effects.catalogue import matching_joints
from tactile_cube.drivetrain.effects.effect import Array, Effect, Place, Stage
from tactile_cube.drivetrain.kernel import MemoryLayout, Topology, load_kernel, plan_memory
from tactile_cube.drivetrain.signals import COMMAND, FRICTION, MOTOR_POSITION, POSITION, VELOCITY
from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import RigidBodyTree

PerJoint = float | tuple[float, ...] | Array
_POSITIVE = ("stiffness", "torque_limit", "rate_limit")


@dataclass(frozen=True)
class DrivetrainConstants:
    """Constants of the drive, from a desired joint angle to a joint torque; the defaults are the hand's.

    Source: Sievers, Pitz, Bauml (ICRA 2022), table of the authors' website.

    Attributes:
        kp: K_P [N m/rad].
        kd: K_D [N m s/rad].
        stiffness: K_e of the drive's elasticity [N m/rad]; infinite for none.
        static_friction: F_static, dry friction of the joint [N m].
        reflected_inertia: i^2 J, the rotor seen from the joint [kg m^2].
        torque_limit: largest torque of the controller [N m].
        rate_limit: fastest change of the filtered target [rad/s].
        sign: `physical`: the motor is ahead of the link, q_m = q + tau / K_e; `printed`: eq. (2) of the paper as it
            stands, q_m = q - tau / K_e.
    """

    kp: PerJoint = 3.69
    kd: PerJoint = 0.25
    stiffness: PerJoint = 25.0
    static_friction: PerJoint = 0.02
    reflected_inertia: PerJoint = 1.5e-3
    torque_limit: PerJoint = 1.0
    rate_limit: PerJoint = np.inf
    sign: Literal["physical", "printed"] = "physical"

    def __post_init__(self) -> None:
        for name in [entry.name for entry in fields(self) if entry.name != "sign"]:
            value, positive = getattr(self, name), name in _POSITIVE
            try:
                numbers = np.asarray(value, dtype=float)
            except (TypeError, ValueError):
                raise InputError(f"drivetrain {name} is {value!r}; give a number or one per joint") from None
            if numbers.ndim > 1 or not np.all(numbers > 0 if positive else numbers >= 0):
                wanted = "positive" if positive else "non-negative"
                raise InputError(f"drivetrain {name} is {value}; give {wanted} numbers")
        if self.sign not in ("physical", "printed"):
            raise InputError(f"stiffness sign is '{self.sign}'; use 'physical' or 'printed'")
        if self.sign == "printed" and np.any(np.asarray(self.kp) >= np.asarray(self.stiffness)):
            raise InputError(
                f"kp {self.kp} with stiffness {self.stiffness} N m/rad is unstable with the printed sign: kp must be "
                "smaller; use sign 'physical'"
            )

    @property
    def compliance(self) -> Array:
        """(q_m - q) / tau [rad/(N m)]: 1 / K_e with the sign chosen."""
        sign = 1.0 if self.sign == "physical" else -1.0
        return sign / np.asarray(self.stiffness, dtype=float)


BOUND = 2.0
MOST_CORNERS = 64


def damping_number(tree: RigidBodyTree, constants: DrivetrainConstants, dt: float, q: Array) -> float:
    """Return dt * eig_max((M(q) + I)^-1 K_D), with the damping at the joint; explicit steps need less than 2.

    Source: hand.md's trial on this hand; explicit Euler on M v' = -K_D v.
    """
    n = len(tree.joint_names)
    M = tree.actuated_mass_matrix(q) + np.diag(np.broadcast_to(constants.reflected_inertia, n))
    reaching = constants.kd / (1.0 + constants.compliance * np.asarray(constants.kp))  # through the elasticity
    damping = np.broadcast_to(np.maximum(constants.kd, reaching), n)
    return float(dt * eigh(np.diag(damping), M, eigvals_only=True)[-1])


def check_damping_stability(
    tree: RigidBodyTree, constants: DrivetrainConstants, dt: float, poses: Iterable[npt.ArrayLike] | None = None
) -> float:
    """Return the largest damping number over poses (n,); by default zero and the corners of the joints' range.

    Raises:
        InputError: it reaches 2: the simulation would diverge.
    """
    worst = max(damping_number(tree, constants, dt, np.asarray(q, dtype=float)) for q in poses or _corners(tree))
    if worst >= BOUND:
        raise InputError(
            f"drivetrain: K_D dt eig_max(M^-1) = {worst:.2f} must stay below 2 (kd {_text(constants.kd)} N m s/rad, dt "
            f"{dt:g} s, reflected_inertia {_text(constants.reflected_inertia)} kg m^2); lower kd or dt, or raise "
            "reflected_inertia"
        )
    return worst


def _corners(tree: RigidBodyTree) -> list[Array]:
    own = [tree.dof_names.index(name) for name in tree.joint_names]
    ends = [(tree.lower[k], tree.upper[k]) for k in own]
    zero = np.zeros(len(own))
    if 2 ** len(own) > MOST_CORNERS or not np.all(np.isfinite(ends)):
        return [zero]
    return [zero, *(np.array(corner) for corner in product(*ends))]


def _text(value: object) -> str:
    return " ".join(f"{number:g}" for number in np.atleast_1d(np.asarray(value, dtype=float)))


EffectClass = type[Effect]

TREE_KEYS = ("ratio", "offset", "placement_rotation", "placement_translation", "axis", "mass", "com", "inertia")
CONSTANT_KEYS = ("kp", "kd", "compliance", "static_friction", "reflected_inertia", "torque_limit", "rate_limit")
_STARTING_ROWS = {POSITION: "q", VELOCITY: "v", MOTOR_POSITION: "q", COMMAND: "q", FRICTION: "static_friction"}
CONTACT_TORQUE_LIMIT = 5.0  # largest contact torque that is believed [N m]: 30 N at the outstretched tip of a finger


LAST_SUBSTEP = 1e9
"""Default of the key `reading`: a rollout reads each row's signals when its command has acted for the whole row."""
UNSURE = 0.025
"""Default of the key `unsure`: time to either side of a segment's start from which its measured speed is read [s]."""


class Plant:
    """C equal chains of n actuated joints each; every number lies in a flat memory that the caller keeps.

    Example:
        >>> plant = Plant([tree], dt=0.002, effects=[StribeckFriction])
        >>> memory = plant.memory(DrivetrainConstants(), gravity=(0, 0, -9.81), effects=[StribeckFriction("q3")])
        >>> plant.reset(memory, q=np.zeros(3))
        >>> plant.kernel.step(np.zeros(3), memory)
    """

    def __init__(
        self,
        trees: Sequence[RigidBodyTree],
        dt: float,
        effects: Sequence[EffectClass] = (),
        joint_names: Sequence[str] | None = None,
        trace_rows: int = 0,
    ) -> None:
        """Describe a plant: equal chains whose trees may differ in their numbers alone, in steps of `dt` [s].

        Effects that can be switched on act in this order within a stage. Joints are named chain by chain, by default by
        the tree with `0/`, `1/` .. before them if there are several. So many steps of the control loop are traced.

        Raises:
            InputError: trees of different structure, a step that is not positive.
        """
        if not dt > 0.0:
            raise InputError(f"dt is {dt} s; the physics step must be positive")
        self.trees = tuple(trees)
        self.dt = float(dt)
        self.effects = tuple(dict.fromkeys(effects))
        self.topology = _common_topology(self.trees)
        chains = enumerate(self.trees)
        own = [name if len(self.trees) == 1 else f"{c}/{name}" for c, tree in chains for name in tree.joint_names]
        self.joint_names = tuple(own if joint_names is None else joint_names)
        if len(self.joint_names) != len(own):
            raise InputError(f"{len(self.joint_names)} joint names for {len(own)} actuated joints; name each once")
        self.trace_rows = trace_rows
        self.layout: MemoryLayout = plan_memory(self.topology, self.effects, self.dt, trace_rows)

    @cached_property
    def kernel(self) -> Any:
        """The compiled steps, generated when first used; see `steps.entry_points`."""
        return load_kernel(self.topology, self.effects, self.layout)

    def view(self, memory: Array, key: str) -> Array:
        """Return a writable view (..., shape) of a key in memory (..., size).

        Raises:
            KeyError: no such key.
        """
        offset, shape = self.layout.entries[key]
        part = memory[..., offset : offset + prod(shape)]
        part.shape = memory.shape[:-1] + shape  # never a copy
        return part

    def signal(self, memory: Array, row: int) -> Array:
        """Return one signal (..., all joints) of the last step, e.g. `signals.MOTOR_POSITION`."""
        rows = self.view(memory, "signals")[..., row, :]
        return rows.reshape(*memory.shape[:-1], self.topology.joints)

    def memory(
        self, constants: DrivetrainConstants, gravity: npt.ArrayLike = (0.0, 0.0, -9.81), effects: Sequence[Effect] = ()
    ) -> Array:
        """Build a memory (size,) at rest at zero, with these constants, and with effects of the plant's classes.

        Per-joint constants hold n (repeated in every chain) or C n numbers; gravity (3,) or (C, 3) [m/s^2] is in the
        frame of each chain's base.
        """
        memory = self._blank.copy()
        for key in ("gravity", "engine_gravity"):
            self.view(memory, key)[...] = gravity
        self.set_constants(memory, constants)
        for effect in effects:
            for joint in matching_joints(effect.joint, self.joint_names):
                self.set_effect(memory, type(effect), joint, effect.values)
        self.reset(memory, np.zeros(self.topology.joints))
        return memory

    @cached_property
    def _blank(self) -> Array:
        """What every memory (size,) holds: the mechanism, the step and where things lie."""
        memory = np.zeros(self.layout.size)
        header = {"dt": self.dt, "trace_rows": self.trace_rows, "reading": LAST_SUBSTEP}
        for key, value in {**header, "trace_offset": self.layout.entries["trace"][0], "unsure": UNSURE}.items():
            self.view(memory, key)[...] = value
        states = [self.layout.entries[f"state:{effect.name}"] for effect in self.effects]
        self.view(memory, "state_offset")[...] = [offset for offset, _ in states]
        self.view(memory, "state_size")[...] = [shape[1] for _, shape in states]
        for key in TREE_KEYS:
            self.view(memory, key)[...] = np.stack([getattr(tree, key) for tree in self.trees])
        self.view(memory, "contact_torque_limit")[...] = CONTACT_TORQUE_LIMIT
        return memory

    def set_constants(self, memory: Array, constants: DrivetrainConstants) -> None:
        """Write the drivetrain's constants into memory (..., size)."""
        for key in CONSTANT_KEYS:
            value = np.asarray(getattr(constants, key), dtype=float)
            size, count = value.shape[-1] if value.ndim else 0, len(self.topology.leader)
            if size not in (0, count, self.topology.joints):
                raise InputError(f"drivetrain {key} has {size} values for {count} joints; give one or one each")
            self.view(memory, key)[...] = np.tile(value, self.topology.chains) if size == count else value
        self.view(memory, "command_torque_limit")[...] = self.view(memory, "torque_limit")

    def set_effect(self, memory: Array, effect: EffectClass, joint: str, values: Mapping[str, float | Array]) -> None:
        """Switch an effect on at a joint of memory (..., size); values may be (batch,) arrays.

        An effect on the MECHANISM changes the constants in place, so apply it once to a fresh memory.
        """
        if effect not in self.effects:
            raise InputError(f"effect '{effect.name}' is not among this plant's effects; name it when it is built")
        a = self._index(joint)
        block = np.empty((*memory.shape[:-1], len(effect.parameters)))
        for k, (key, default) in enumerate(effect.defaults(values).items()):
            block[..., k] = values.get(key, default)
        if effect.stage is Stage.MECHANISM:
            effect.configure(lambda key: self.view(memory, key), self.place(joint), block)
            return
        self.view(memory, f"parameters:{effect.name}")[..., a, :] = block
        self.view(memory, f"active:{effect.name}")[..., a] = 1.0
        if effect.weighs:
            self.view(memory, "needs_weight")[...] = 1.0

    def place(self, joint: str) -> Place:
        """Return the place of a joint in the plant."""
        a = self._index(joint)
        chain, j = divmod(a, len(self.topology.leader))
        link = self.topology.leader[j]
        follow = self.topology.follow
        followers = tuple(k for k, leader in enumerate(follow) if leader == j and k != link)
        return Place(joint=a, chain=chain, link=link, followers=followers)

    def reset(self, memory: Array, q: npt.ArrayLike, v: npt.ArrayLike = 0.0) -> None:
        """Start memory (..., size) anew at positions q [rad] and speeds v [rad/s] (..., all joints) of the links.

        Filters are at q, effects without a past.
        """
        for key in ("q", "filtered", "limited", "goal"):
            self.view(memory, key)[...] = q
        self.view(memory, "v")[...] = v
        for key in ("extra", "extra_compliance", "held_back", "contact", "signals", "seen", "step"):
            self.view(memory, key)[...] = 0.0
        if self.effects:  # their states follow each other
            first, _ = self.layout.entries[f"state:{self.effects[0].name}"]
            memory[..., first : self.layout.entries["trace"][0]] = 0.0
        by_chain = (*memory.shape[:-1], self.topology.chains, len(self.topology.leader))
        rows = self.view(memory, "signals")
        for row, key in _STARTING_ROWS.items():
            rows[..., row, :] = self.view(memory, key).reshape(by_chain)

    def _index(self, joint: str) -> int:
        if joint not in self.joint_names:
            raise InputError(f"joint '{joint}' is unknown; the joints are {', '.join(self.joint_names)}")
        return self.joint_names.index(joint)


def _common_topology(trees: Sequence[RigidBodyTree]) -> Topology:
    found = []
    for tree in trees:
        leader = tuple(tree.dof_names.index(name) for name in tree.joint_names)
        parent, prismatic, follow = (tuple(map(int, part)) for part in (tree.parent, tree.prismatic, tree.follow))
        found.append(Topology(len(trees), parent, prismatic, follow, leader))
    if not found or any(topology != found[0] for topology in found):
        raise InputError(f"a plant needs chains of equal structure; got {len(found)} that differ; use one tree for all")
    return found[0]
