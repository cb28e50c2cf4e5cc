"""Contact that the chosen steps and iterations do not resolve."""

from __future__ import annotations

from collections.abc import Sequence

from tactile_cube.simulation.options import SimulationOptions

RESOLVED = 0.05
"""Spinning friction [m] up to which PyBullet's answers at 2 ms and 30 iterations stand: a twist by 0.5 rad changes by
3 % at most when both are refined tenfold, at 0.1 m by 10 % (docs/results/mechanics.md)."""
REFERENCE_STEP, REFERENCE_ITERATIONS = 2e-4, 300
"""What those refined answers were computed with: step [s] and iterations."""


def unresolved(spinning_friction: float, options: SimulationOptions) -> str:
    """What to know about worlds whose answers are those of an unconverged solver; "" where there is nothing.

    Args:
        spinning_friction: the largest of the tips [m].
        options: of the worlds; MuJoCo's solver runs until it has converged.
    """
    reference = options.dt <= REFERENCE_STEP and options.solver_iterations >= REFERENCE_ITERATIONS
    if options.engine == "mujoco" or spinning_friction <= RESOLVED or reference:
        return ""
    return (
        f"tip_spinning_friction of {spinning_friction:g} m: PyBullet with {options.solver_iterations} iterations of "
        f"{1e3 * options.dt:g} ms resolves up to {RESOLVED:g} m; beyond, finer steps turn and tilt a cube otherwise"
    )


def unresolved_among(spinning_frictions: Sequence[float], options: SimulationOptions) -> str:
    """What to know about worlds that were drawn, with the number of those it concerns; "" where it concerns none.

    Args:
        spinning_frictions: of the tips, one a world [m].
        options: of the worlds.
    """
    beyond = [friction for friction in spinning_frictions if unresolved(friction, options)]
    return f"{len(beyond)} of {len(spinning_frictions)} worlds: {unresolved(max(beyond), options)}" if beyond else ""
