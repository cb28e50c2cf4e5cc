"""Tells physics that has failed from physics that has not: numbers, speeds and overlaps within generous bounds.

In ordinary episodes joints stay below 3 rad/s, contact forces below 12 N and overlaps below 1 mm.
"""

from collections.abc import Sequence
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from tactile_cube.compiled import compiled_once
from tactile_cube.simulation.engine import SimulationOptions

Array = NDArray[np.float64]

BOUNDS = (
    ("joint speed", 60.0, "rad/s"),  # the drives reach about 6
    ("cube speed", 5.0, "m/s"),  # half a second of free fall
    ("cube spin", 100.0, "rad/s"),
    ("tendon stretch", 0.3, "rad"),  # largest difference between q4 and q3
    ("overlap", 6e-3, "m"),  # of two bodies; a fingertip's radius is 14 mm
)


def find_fault(q: Array, v: Array, cube: Array, distances: Sequence[float], coupled: NDArray[np.int64]) -> str:
    """Describe the fault of a state in a few words; "" if it has none.

    Angles and velocities of all joints are (fingers, links), the cube's state (13,), `distances` the gaps of contact
    points [m], `coupled` (pairs, 2) links that follow another one of their finger, and which.
    """
    values = (*_extremes(q, v, cube, coupled), -min(distances, default=0.0))
    for (name, bound, unit), value in zip(BOUNDS, values, strict=True):
        if not isfinite(value):
            return f"{name} is not a number"
        if value > bound:
            return f"{name} {value:.3g} {unit} above {bound:g}"
    return ""


@compiled_once
def _extremes(q: Array, v: Array, cube: Array, coupled: NDArray[np.int64]) -> tuple[float, float, float, float]:
    """Return the largest joint speed, cube speed, cube spin and tendon stretch; infinite where a number is none."""
    speed = stretch = linear = angular = 0.0
    for finger in range(q.shape[0]):
        for pair in range(coupled.shape[0]):
            stretch = max(stretch, abs(q[finger, coupled[pair, 0]] - q[finger, coupled[pair, 1]]))
        for joint in range(q.shape[1]):
            speed = max(speed, abs(v[finger, joint]))
            if not np.isfinite(q[finger, joint] + v[finger, joint]):
                speed = inf
    for axis in range(3):
        linear, angular = max(linear, abs(cube[7 + axis])), max(angular, abs(cube[10 + axis]))
    if not np.all(np.isfinite(cube)):
        linear = inf
    return speed, linear, angular, stretch


RESOLVED = 0.05
"""Spinning friction [m] up to which PyBullet's answers at 2 ms and 30 iterations stand: a twist by 0.5 rad changes by
3 % at most when both are refined tenfold, at 0.1 m by 10 % (docs/results/contact.md)."""
REFERENCE_STEP, REFERENCE_ITERATIONS = 2e-4, 300
"""What those refined answers were computed with: step [s] and iterations."""


def unresolved(spinning_friction: float, options: SimulationOptions) -> str:
    """Return a warning about worlds whose solver does not converge, by the tips' spinning friction [m].

    "" if there is none: MuJoCo's solver runs until it has converged.
    """
    reference = options.dt <= REFERENCE_STEP and options.solver_iterations >= REFERENCE_ITERATIONS
    if options.engine == "mujoco" or spinning_friction <= RESOLVED or reference:
        return ""
    return (
        f"tip_spinning_friction of {spinning_friction:g} m: PyBullet with {options.solver_iterations} iterations of "
        f"{1e3 * options.dt:g} ms resolves up to {RESOLVED:g} m; beyond, finer steps turn and tilt a cube otherwise"
    )


def unresolved_among(spinning_frictions: Sequence[float], options: SimulationOptions) -> str:
    """Return the same warning about worlds that were drawn, with the number of those affected; "" if none."""
    beyond = [friction for friction in spinning_frictions if unresolved(friction, options)]
    return f"{len(beyond)} of {len(spinning_frictions)} worlds: {unresolved(max(beyond), options)}" if beyond else ""
