"""Creep: a cube held by four tips under its weight stays where it is."""

from __future__ import annotations

import numpy as np

from benchmarks.mechanics.case import Answer
from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.engine import SimulationOptions
from tactile_cube.simulation.world import World

SQUEEZE = 0.01
_SETTLED, _END = 50, 100


def creep(options: SimulationOptions) -> Answer:
    """Way of a held cube between 5 s and 10 s; dry friction holds without any."""
    world = World(options=options)
    world.reset(EpisodeConstants(), Start(DLR_HAND2.start_angles))
    target = grasp_angles(DLR_HAND2, [0.08] * 3, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], -SQUEEZE)
    for step in range(_END):
        world.step(target)
        if step == _SETTLED - 1:
            settled = world.cube_position.copy()
    way = float(np.linalg.norm(world.cube_position - settled))
    world.close()
    return Answer("way of a held cube from 5 s to 10 s", "mm", 0.0, 1e3 * way)
