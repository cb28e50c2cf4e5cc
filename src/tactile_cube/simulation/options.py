"""How the world is computed: time step, solver accuracy, loop. Nothing here is a property of the hand or the cube."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tactile_cube.errors import InputError

Loop = Literal["auto", "c", "python"]
LOOPS = ("auto", "c", "python")


@dataclass(frozen=True)
class SimulationOptions:
    """Numerical choices of a world.

    Attributes:
        dt: Physics step [s]; 2 ms as in the paper.
        substeps: Physics steps per policy step; 50 x 2 ms = the paper's 10 Hz.
        solver_iterations: Iterations of Bullet's contact solver per physics step.
        loop: Who runs the physics steps of a policy step: `c` (one compiled loop), `python` (the same steps from
            Python, bit for bit), or `auto`: `c` where a C compiler is found.
        trace: Keep the signals of every physics step of the last policy step (`World.trace`).
    """

    dt: float = 2e-3
    substeps: int = 50
    solver_iterations: int = 30
    loop: Loop = "auto"
    trace: bool = False

    def __post_init__(self) -> None:
        """Refuse values that no world can run with."""
        if not 0.0 < self.dt <= 0.01:
            raise InputError(f"simulation.dt is {self.dt} s; choose a physics step above 0 and up to 0.01 s")
        for name in ("substeps", "solver_iterations"):
            if getattr(self, name) < 1:
                raise InputError(f"simulation.{name} is {getattr(self, name)}; choose 1 or more")
        if self.loop not in LOOPS:
            raise InputError(f"simulation.loop is {self.loop!r}; choose one of {', '.join(LOOPS)}")

    @property
    def policy_dt(self) -> float:
        """Duration of a policy step [s]."""
        return self.dt * self.substeps

    @classmethod
    def fast(cls) -> SimulationOptions:
        """For training: 2 ms, 30 iterations."""
        return cls()

    @classmethod
    def faithful(cls) -> SimulationOptions:
        """For final numbers: 0.5 ms and 150 iterations, close to convergence, at a tenth of the speed."""
        return cls(dt=5e-4, substeps=200, solver_iterations=150)
