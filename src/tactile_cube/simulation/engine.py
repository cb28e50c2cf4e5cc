"""What a physics engine does for the world, under the drive's torques: options, contacts, surfaces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, Protocol

from tactile_cube.errors import InputError
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
    """A contact told from the side of the finger; of the table where no finger takes part.

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
        """Both together."""
        return Surface(
            self.lateral * other.lateral,
            self.spinning * other.lateral + other.spinning * self.lateral,
            self.compliance + other.compliance,
        )


def surfaces(constants: EpisodeConstants) -> dict[str, Surface]:
    """The surfaces of an episode: `tip`, `link` (all other links), `cube` and `table`."""
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
        """Options of one of several worlds side by side: with `mixed`, engines alternate."""
        return replace(self, engine=_SINGLE[index % len(_SINGLE)]) if self.engine == "mixed" else self

    @property
    def policy_dt(self) -> float:
        """Duration of a policy step [s]."""
        return self.dt * self.substeps

    @classmethod
    def faithful(cls, engine: EngineName = "bullet") -> SimulationOptions:
        """For final numbers: 0.5 ms and 150 iterations, close to convergence, at a tenth of the speed."""
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
        """Puts everything at the start of an episode, the joints at q, v; nothing of the past remains, to the bit."""

    def set_gravity(self, acceleration: Array) -> None:
        """Sets the world's gravity (3,) [m/s^2]."""

    def run(self, steps: int, wrench: Array | None, record: bool) -> Array | None:
        """Runs physics steps: control, apply torques, step.

        A wrench (6,) [N, N m] acts on the cube's centre of mass in the world. With `record` it gives the cube's states
        before each step and after the last (steps + 1, 13).
        """

    def cube_state(self) -> Array:
        """Pose and velocity of the cube's centre in the world (13,), see `OBJECT_STATE`."""

    def gaps(self) -> list[float]:
        """Gaps of the contact points of the last physics step [m], negative where bodies overlap."""

    def contacts(self) -> list[Contact]:
        """Contacts on the cube and between fingers in the last physics step."""

    def normal_forces(self) -> Array:
        """Sums of the normal forces on the object of each finger's other links and of its tip (2, fingers) [N]."""

    def close(self) -> None:
        """Ends the simulation."""
