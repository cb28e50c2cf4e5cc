"""A case: something measured in a world, beside what mechanics says."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.engine import SimulationOptions
from tactile_cube.simulation.world import World


@dataclass(frozen=True)
class Answer:
    """Result of a case.

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


ACCURACY = {"fast": SimulationOptions, "faithful": SimulationOptions.faithful}
_TIMED = 50


@dataclass(frozen=True)
class Setting:
    """Results of one engine at one accuracy setting.

    Attributes:
        name: Engine and accuracy, e.g. `mujoco fast`.
        answers: By name of the case.
        cost: Processor time per simulated second while four tips hold the cube [s].
    """

    name: str
    answers: dict[str, Answer]
    cost: float


def measure(options: dict[str, SimulationOptions], cases: dict[str, Case], say: Callable[[str], None]) -> list[Setting]:
    """All cases in all settings; deterministic but for the cost."""
    found = []
    for name, one in options.items():
        answers = {}
        for case, run in cases.items():
            answers[case] = run(one)
            say(f"{name}, {case}: {answers[case]}")
        found.append(Setting(name, answers, _cost(one)))
    return found


def _cost(options: SimulationOptions) -> float:
    world = World(options=options)
    world.reset(EpisodeConstants(), Start(DLR_HAND2.start_angles))
    target = grasp_angles(DLR_HAND2, [0.08] * 3, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], -0.01)
    seconds = []
    for _ in range(_TIMED):
        began = time.process_time()
        world.step(target)
        seconds.append(time.process_time() - began)
    world.close()
    return sorted(seconds)[_TIMED // 2] / options.policy_dt
