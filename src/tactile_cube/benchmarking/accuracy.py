"""Section: what the numerical options of the simulation cost and buy."""

from __future__ import annotations

import numpy as np

from tactile_cube.benchmarking.report import Figure, Section
from tactile_cube.simulation import SimulationOptions
from tactile_cube.simulation.accuracy import REFERENCE, Accuracy, measure_accuracy

OPTIONS = {
    "fast": SimulationOptions.fast(),
    "fast, 20 iterations": SimulationOptions(solver_iterations=20),
    "fast, 50 iterations": SimulationOptions(solver_iterations=50),
    "faithful": SimulationOptions.faithful(),
}
REFERENCE_NAME = "reference: 0.5 ms, 500 iterations"


def accuracy(options: dict[str, SimulationOptions] | None = None, reference: SimulationOptions = REFERENCE) -> Section:
    """Speed of each option, and how far a held and twisted cube is from the converged reference."""
    title = "a cube held for 10 s and twisted by 0.5 rad, against a converged simulation"
    section = Section("accuracy", title, REFERENCE_NAME)
    converged = measure_accuracy(reference)
    found = {name: measure_accuracy(option) for name, option in (options or OPTIONS).items()}
    for name, one in {**found, REFERENCE_NAME: converged}.items():
        speed = one.steps_per_second
        ratio = speed / converged.steps_per_second
        section.figures.append(Figure(name, speed, speed, speed, "steps/s", ratio, _deviation(one, converged)))
    return section


def _deviation(one: Accuracy, converged: Accuracy) -> str:
    parts = [
        f"creep {one.creep * 1e3:.3f} mm",
        f"rest {np.linalg.norm(one.rest - converged.rest) * 1e3:.2f} mm off",
        f"tip force {np.abs(one.tip_forces - converged.tip_forces).max():.2f} N off",
        f"q4-q3 {one.coupling_error * 1e3:.2f} mrad",
        f"twist {(one.twist - converged.twist) * 1e3:+.1f} mrad off",
    ]
    return ", ".join([*parts, one.fault] if one.fault else parts)
