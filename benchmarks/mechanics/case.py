"""A case: something measured in a world, beside what mechanics says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tactile_cube.simulation.engine import SimulationOptions


@dataclass(frozen=True)
class Answer:
    """What came of a case.

    Attributes:
        quantity: What is measured, in words.
        unit: Its unit.
        expected: What mechanics says, of the forces that the simulation itself reports.
        measured: What the simulation does.
    """

    quantity: str
    unit: str
    expected: float
    measured: float

    @property
    def deviation(self) -> float:
        """Relative deviation; infinite where mechanics says zero."""
        return self.measured / self.expected - 1.0 if self.expected else float("inf")

    def __str__(self) -> str:
        """The deviation, or what was measured where mechanics says zero."""
        return f"{self.deviation:+.1%}" if self.expected else f"{self.measured:.3f} {self.unit}"


Case = Callable[[SimulationOptions], Answer]
