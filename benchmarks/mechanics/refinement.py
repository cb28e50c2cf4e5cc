"""What changes when steps and iterations are refined tenfold: a held cube, a scripted twist, a scripted gait."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks.mechanics.held_cube import measure_accuracy
from tactile_cube.hand import DLR_HAND2, Gait
from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.engine import SimulationOptions
from tactile_cube.simulation.world import World

Array = NDArray[np.float64]

FACTOR = 10
GAIT_STEPS = 60
"""Policy steps of the gait: 6 s, a cycle."""


@dataclass(frozen=True)
class Outcome:
    """Results of the motions.

    Attributes:
        rest: Where the held cube is after 10 s (3,) [m].
        force: Normal force of each finger then (4,) [N].
        twist: Yaw after the scripted twist [rad].
        gait: Yaw, tilt [rad] and height [m] of the cube after each policy step of the gait (GAIT_STEPS, 3).
    """

    rest: Array
    force: Array
    twist: float
    gait: Array


@dataclass(frozen=True)
class Refinement:
    """One engine at one spinning friction.

    Attributes:
        engine: Its name.
        spinning: Spinning friction of the tips [m].
        coarse: At the options given.
        fine: At a tenth of the step and ten times the iterations.
    """

    engine: str
    spinning: float
    coarse: Outcome
    fine: Outcome


def refined(options: SimulationOptions) -> SimulationOptions:
    """A tenth of the step, ten times the iterations."""
    return replace(
        options,
        dt=options.dt / FACTOR,
        substeps=options.substeps * FACTOR,
        solver_iterations=options.solver_iterations * FACTOR,
    )


def refine(options: SimulationOptions, spinning: Sequence[float], say: Callable[[str], None]) -> list[Refinement]:
    """The motions as given and refined, at each spinning friction [m]."""
    found = []
    for one in spinning:
        coarse, fine = (outcome(setting, one) for setting in (options, refined(options)))
        found.append(Refinement(options.engine, one, coarse, fine))
        say(f"{options.engine}, spinning friction {1e3 * one:g} mm: refined")
    return found


def outcome(options: SimulationOptions, spinning: float) -> Outcome:
    """Runs the motions; deterministic."""
    constants = EpisodeConstants(tip_spinning_friction=spinning)
    held = measure_accuracy(options, constants)
    return Outcome(held.rest, held.tip_forces, held.twist, _walk(options, constants))


def _walk(options: SimulationOptions, constants: EpisodeConstants) -> Array:
    world, gait = World(options=options), Gait()
    world.reset(replace(constants, filter_time=0.25), Start(DLR_HAND2.start_angles))
    rows = []
    for step in range(GAIT_STEPS):
        world.step(DLR_HAND2.angles_at(gait.tips(step)[None])[0])
        turn = Rotation.from_quat(world.cube_quaternion)
        upright = float(np.clip(turn.as_matrix()[2, 2], -1.0, 1.0))
        rows.append([turn.as_euler("ZYX")[0], np.arccos(upright), world.cube_position[2]])
    world.close()
    return np.array(rows)
