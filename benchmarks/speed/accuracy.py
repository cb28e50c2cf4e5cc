"""Section: what the numerical options of the simulation cost and buy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.mechanics.held_cube import REFERENCE, Accuracy, measure_accuracy
from benchmarks.speed.report import Figure, Section
from tactile_cube.simulation import SimulationOptions

OPTIONS = {
    "fast": SimulationOptions(),
    "fast, 20 iterations": SimulationOptions(solver_iterations=20),
    "fast, 50 iterations": SimulationOptions(solver_iterations=50),
    "faithful": SimulationOptions.faithful(),
    "engine=mujoco, fast": SimulationOptions("mujoco"),
    "engine=mujoco, faithful": SimulationOptions.faithful("mujoco"),
}
REFERENCE_NAME = "reference: 0.5 ms, 500 iterations"


def accuracy(options: dict[str, SimulationOptions] | None = None, reference: SimulationOptions = REFERENCE) -> Section:
    """Speed of each option, and how far a held and twisted cube is from its engine's converged reference."""
    title = "a cube held for 10 s and twisted by 0.5 rad, against the same engine converged"
    section = Section("accuracy", title, REFERENCE_NAME)
    options = options or OPTIONS
    converged = {e: measure_accuracy(replace(reference, engine=e)) for e in {o.engine for o in options.values()}}
    yardstick = converged[reference.engine].steps_per_second
    references = {REFERENCE_NAME if e == reference.engine else f"engine={e}, {REFERENCE_NAME}": e for e in converged}
    found = {name: (measure_accuracy(option), option.engine) for name, option in options.items()}
    found |= {name: (converged[engine], engine) for name, engine in references.items()}
    for name, (one, engine) in found.items():
        speed, note = one.steps_per_second, _deviation(one, converged[engine])
        section.figures.append(Figure(name, speed, speed, speed, "steps/s", speed / yardstick, note))
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
