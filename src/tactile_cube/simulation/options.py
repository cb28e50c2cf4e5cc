"""How the world is computed: time step, solver accuracy. Nothing here is a property of the hand or the cube."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from tactile_cube.errors import InputError

EngineName = Literal["bullet", "mujoco", "mixed"]
MOST = 100_000
"""Physics steps of a policy step, and iterations of a physics step."""
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
        """Refuse values that no world can run with."""
        if self.engine not in ENGINES:
            raise InputError(f"simulation.engine is {self.engine!r}; choose one of {', '.join(ENGINES)}")
        if not 0.0 < self.dt <= 0.01:
            raise InputError(f"simulation.dt is {self.dt} s; choose a physics step above 0 and up to 0.01 s")
        for name in ("substeps", "solver_iterations"):
            if not 1 <= getattr(self, name) <= MOST:
                raise InputError(f"simulation.{name} is {getattr(self, name)}; choose 1 to {MOST}")

    @property
    def single_engine(self) -> Literal["bullet", "mujoco"]:
        """The engine of one world.

        Raises:
            InputError: The options name several.
        """
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
