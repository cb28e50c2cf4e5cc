"""What every engine can do, and the drivetrain of all fingers that acts in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np

from tactile_cube.drivetrain import DrivetrainConstants, Plant, check_damping_stability
from tactile_cube.drivetrain.effects import Effect
from tactile_cube.drivetrain.plant import CONSTANT_KEYS
from tactile_cube.errors import InputError
from tactile_cube.hand import Hand
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.hand.urdf import with_inertias
from tactile_cube.simulation.constants import Array, EpisodeConstants, Start


@dataclass(frozen=True)
class Contact:
    """One contact point on the cube or between fingers.

    Attributes:
        finger: Name of the finger, or `table` where the cube lies on it.
        link: Name of its link, "" for the table.
        other: What it touches: `cube`, `table` or the name of another finger.
        position: Point on the other body, in the world (3,) [m].
        normal: Unit vector into the other body (3,).
        distance: Gap [m], negative where the bodies overlap.
        force: Normal force [N].
        friction: Friction force on the other body (3,) [N].
    """

    finger: str
    link: str
    other: str
    position: Array
    normal: Array
    distance: float
    force: float
    friction: Array


def named_contact(
    first: tuple[str, str],
    second: tuple[str, str],
    middle: Array,
    normal: Array,
    distance: float,
    force: float,
    friction: Array,
) -> Contact:
    """Return a contact from the side of the finger, or of the table where no finger takes part.

    `first` and `second` name a body (finger, `cube` or `table`) and its link, "" where there is none; `middle` (3,) [m]
    lies between the two surfaces, `normal` and `friction` point into and act on the second.
    """
    if first[0] == "cube" or (first[0] == "table" and second[0] != "cube"):
        first, second, normal, friction = second, first, -normal, -friction
    return Contact(*first, second[0], middle + 0.5 * distance * normal, normal, distance, force, friction)


SKIN_RELAXATION = 5e-3  # damping over stiffness of a fingertip's skin [s]: rubber settles within a few ms


@dataclass(frozen=True)
class Surface:
    """A body's side of a contact.

    Attributes:
        lateral: Factor of Coulomb friction.
        spinning: Torque against spinning per normal force [m], on a body whose factor is 1.
        compliance: How far it gives way per normal force [m/N]; 0: hard.
    """

    lateral: float
    spinning: float = 0.0
    compliance: float = 0.0

    def on(self, other: Surface) -> Surface:
        """Combine both."""
        return Surface(
            self.lateral * other.lateral,
            self.spinning * other.lateral + other.spinning * self.lateral,
            self.compliance + other.compliance,
        )


def surfaces(constants: EpisodeConstants) -> dict[str, Surface]:
    """Return the surfaces of an episode: `tip`, `link` (all other links), `cube` and `table`."""
    return {
        "tip": Surface(constants.tip_friction, constants.tip_spinning_friction, constants.tip_compliance),
        "link": Surface(constants.link_friction),
        "cube": Surface(constants.cube_friction),
        "table": Surface(constants.table_friction),
    }


EngineName = Literal["bullet", "mujoco", "mixed"]
MOST = 100_000  # physics steps of a policy step, and iterations of a physics step
ENGINES = ("bullet", "mujoco", "mixed")
_SINGLE: tuple[Literal["bullet", "mujoco"], ...] = ("bullet", "mujoco")


@dataclass(frozen=True)
class SimulationOptions:
    """Numerical choices of a world.

    Attributes:
        engine: Who computes contacts and motion: `bullet` (PyBullet), `mujoco`, or `mixed`: of worlds side by side the
            first, third .. in PyBullet, the others in MuJoCo.
        dt: Physics step [s]; 2 ms as in the paper.
        substeps: Physics steps per policy step; 50 x 2 ms = the paper's 10 Hz.
        solver_iterations: Iterations of the contact solver per physics step: of PyBullet always so many, of MuJoCo at
            most (its Newton solver ends after two to five).
        trace: Keep the signals of every physics step of the last policy step (`World.trace`).
    """

    engine: EngineName = "bullet"
    dt: float = 2e-3
    substeps: int = 50
    solver_iterations: int = 30
    trace: bool = False

    def __post_init__(self) -> None:
        if self.engine not in ENGINES:
            raise InputError(f"simulation.engine is {self.engine!r}; choose one of {', '.join(ENGINES)}")
        if not 0.0 < self.dt <= 0.01:
            raise InputError(f"simulation.dt is {self.dt} s; choose a physics step above 0 and up to 0.01 s")
        for name in ("substeps", "solver_iterations"):
            if not 1 <= getattr(self, name) <= MOST:
                raise InputError(f"simulation.{name} is {getattr(self, name)}; choose 1 to {MOST}")

    @property
    def single_engine(self) -> Literal["bullet", "mujoco"]:
        """The engine of one world. Raises InputError: The options name several."""
        if self.engine == "mixed":
            raise InputError(
                "simulation.engine is 'mixed', which needs several worlds; choose bullet or mujoco for one"
            )
        return self.engine

    def of_world(self, index: int) -> SimulationOptions:
        """Return the options of one of several worlds side by side: with `mixed`, engines alternate."""
        return replace(self, engine=_SINGLE[index % len(_SINGLE)]) if self.engine == "mixed" else self

    @property
    def policy_dt(self) -> float:
        """Duration of a policy step [s]."""
        return self.dt * self.substeps

    @classmethod
    def faithful(cls, engine: EngineName = "bullet") -> SimulationOptions:
        """Return options for final numbers: 0.5 ms and 150 iterations, nearly converged, at a tenth of the speed."""
        return cls(engine, dt=5e-4, substeps=200, solver_iterations=150)


OBJECT_STATE = 13  # position (3), quaternion xyzw (4), linear and angular velocity (3 + 3) of the object


class Engine(Protocol):
    """One hand, one object and perhaps a table. Joint arrays are (fingers, links), from the palm to the tip.

    Attributes:
        q: Positions of all joints [rad].
        v: Their velocities [rad/s].
    """

    q: Array
    v: Array

    def place(self, constants: EpisodeConstants, start: Start, q: Array, v: Array) -> None:
        """Put everything at the start of an episode, the joints at q, v; nothing of the past remains, to the bit."""

    def set_gravity(self, acceleration: Array) -> None:
        """Set the world's gravity (3,) [m/s^2]."""

    def run(self, steps: int, wrench: Array | None, record: bool) -> Array | None:
        """Run physics steps: control, apply torques, step.

        A wrench (6,) [N, N m] acts on the cube's centre of mass in the world. With `record` it gives the cube's states
        before each step and after the last (steps + 1, 13).
        """

    def cube_state(self) -> Array:
        """Return the pose and velocity of the cube's centre in the world (13,), see `OBJECT_STATE`."""

    def gaps(self) -> list[float]:
        """Return the gaps of the contact points of the last physics step [m], negative where bodies overlap."""

    def contacts(self) -> list[Contact]:
        """Return the contacts on the cube and between fingers in the last physics step."""

    def normal_forces(self) -> Array:
        """Return sums of normal forces on the object of each finger's other links and of its tip (2, fingers) [N]."""

    def close(self) -> None:
        """End the simulation."""


class HandDrive:
    """Control step and its memory for the fingers of a hand.

    Attributes:
        plant: The compiled control step of all fingers and the layout of its memory.
        memory: The numbers it works on; the same array for good.
    """

    def __init__(self, hand: Hand, options: SimulationOptions, effects: Sequence[Effect]) -> None:
        self._hand, self._engine = hand, options.single_engine
        self._effects = list(effects)
        self._urdfs = [hand.finger_urdf(k) for k in range(len(hand.fingers))]
        known = {text: RigidBodyTree.from_urdf(text) for text in dict.fromkeys(self._urdfs)}
        self._trees = [known[text] for text in self._urdfs]
        self._shares = spin_shares(self._trees[0])
        self.plant = Plant(
            trees=self._trees,
            dt=options.dt,
            effects=tuple(dict.fromkeys(type(effect) for effect in effects)),
            joint_names=hand.joint_names,
            trace_rows=options.substeps if options.trace else 0,
        )
        self.memory = self.plant.memory(DrivetrainConstants(), effects=self._effects)

    def finger_urdfs(self) -> list[str]:
        """Return the URDF text of each finger, with the masses that effects on the mechanism have changed."""
        mass, com, inertia = (self.view(key) for key in ("mass", "com", "inertia"))
        texts = []
        for k, (text, tree) in enumerate(zip(self._urdfs, self._trees, strict=True)):
            same = np.array_equal(mass[k], tree.mass) and np.array_equal(com[k], tree.com)
            changed = (self._hand.fingers[k].links, mass[k], com[k], inertia[k])
            texts.append(text if same else with_inertias(text, *changed))
        return texts

    def reset(self, c: EpisodeConstants, start: Start) -> None:
        """Fill the memory for an episode and put it at rest at the start.

        Raises:
            InputError: The torque loop would be unstable with these constants and this time step.
        """
        named = {key: getattr(c, key) for key in CONSTANT_KEYS if key != "compliance"} | {"stiffness": c.stiffness}
        constants = DrivetrainConstants(**named, sign="physical" if c.elasticity_sign > 0 else "printed")
        self._refuse_unstable(constants)
        gravity = self._in_bases(c.gravity * c.down)
        self.memory[:] = self.plant.memory(constants, gravity=gravity, effects=[*self._effects, *c.effects])
        self.view("friction_creep")[:] = c.friction_creep
        self.view("time_constant")[:] = c.filter_time
        if self._engine == "mujoco":  # its own rotors and tendons
            rotors = self.view("reflected_inertia").reshape(-1, self._hand.joints_per_finger)
            self.view("armature")[:, list(self.plant.topology.leader)] = rotors
        else:  # numerical aids that the torques know of
            self.view("spin_inertia")[:] = spin_inertia(self._hand, self._shares, np.asarray(c.reflected_inertia))
            self.view("tendon_stiffness")[:] = TENDON_STIFFNESS
            self.view("tendon_damping")[:] = TENDON_DAMPING
        self.plant.reset(self.memory, start.angles, v=start.velocities)
        for key in ("filtered", "limited", "goal"):
            self.view(key)[:] = start.angles if start.target is None else start.target - c.joint_offset

    def view(self, key: str) -> Array:
        """Return writable numbers of the memory."""
        return self.plant.view(self.memory, key)

    def signal(self, row: int) -> Array:
        """Return a signal of the last physics step (joints,)."""
        return self.plant.signal(self.memory, row)

    def set_engine_gravity(self, acceleration: Array) -> None:
        """Tell the control step what gravity the engine applies (3,) [m/s^2]; the fingers keep feeling their own."""
        self.view("engine_gravity")[:] = self._in_bases(acceleration)

    def sense(self, q: Array, v: Array) -> None:
        """Compute what the sensors read at rest at q, v (all joints,), without changing any state."""
        trial = self.memory.copy()
        self.plant.kernel.control_step(0, q.copy(), v.copy(), np.zeros_like(q), trial)
        self.view("signals")[:] = self.plant.view(trial, "signals")

    def _refuse_unstable(self, c: DrivetrainConstants) -> None:
        """Raise InputError if a finger with the largest damping and smallest inertia of each joint would diverge."""
        of_fingers = {
            name: np.reshape(getattr(c, name), (-1, self._hand.joints_per_finger))
            for name in ("kp", "kd", "stiffness", "reflected_inertia")
        }
        weakest = {name: values.max(axis=0) for name, values in of_fingers.items()}
        weakest |= {name: of_fingers[name].min(axis=0) for name in ("stiffness", "reflected_inertia")}
        for tree in {id(tree): tree for tree in self._trees}.values():
            check_damping_stability(tree, replace(c, static_friction=0.0, **weakest), self.plant.dt)

    def _in_bases(self, vector: Array) -> Array:
        """Rotate a world vector into the frame of each finger's base (fingers, 3)."""
        rotations = [self._hand.base_in_world(k)[1] for k in range(len(self._hand.fingers))]
        return np.stack([rotation.T @ vector for rotation in rotations])


LEAST_INERTIA = 1e-3  # reflected inertia below which spin inertia is not lowered further [kg m^2]
TENDON_STIFFNESS = 15.0  # spring that holds q4 at q3 [N m/rad]
TENDON_DAMPING = 0.02  # its damping [N m s/rad]; stable while k dt^2 w + 2 d dt w < 4 with w = (J3 + 4 J4) / (J3 J4)


PARALLEL = 0.99  # cosine of the angle between axes from which on they count as parallel


def spin_inertia(hand: Hand, shares: Array, reflected_inertia: Array) -> Array:
    """Return spin inertia of each link about its joint (fingers, links), from I_a of the joints (joints,) [kg m^2]."""
    return np.asarray(np.maximum(hand.all_angles(reflected_inertia), LEAST_INERTIA) * shares)


def spin_shares(tree: RigidBodyTree) -> Array:
    """Return the share of a joint's reflected inertia that its link spins with (links,).

    Joints in a row with parallel axes share it, for all further links turn with the first of them: three of them take
    1/2, 1/3 and 1/6.
    """
    groups: list[int] = []
    turn, before = np.eye(3), np.zeros(3)
    for k in range(tree.dofs):
        turn = turn @ tree.placement_rotation[k]
        axis = turn @ tree.axis[k]
        if groups and abs(float(axis @ before)) > PARALLEL:
            groups[-1] += 1
        else:
            groups.append(1)
        before = axis
    return np.concatenate([np.arange(count, 0, -1) / (count * (count + 1) // 2) for count in groups])
