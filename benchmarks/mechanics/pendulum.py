"""Hanging: a box swings between two tips, its centre of mass below their axis; spinning friction takes its swing.

Over half a swing from angle a to b on the other side, the weight W at a lever L gives W L (cos b - cos a), which
friction takes with t (a + b), where t is the torque that both tips bear.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from benchmarks.mechanics.case import Answer
from benchmarks.mechanics.pinch import GRAVITY, ROUND_TIPS, box, centre_of_mass, grip, pinch, roll_of
from tactile_cube.simulation.engine import SimulationOptions
from tactile_cube.simulation.world import World

SQUEEZE = 0.003
ANGLE = 0.8
MASS, LEVER = 0.02, 0.04
FRICTION, SPINNING = 0.9, 3e-4


def pendulum(options: SimulationOptions) -> Answer:
    """Angle lost in the first half swing; policy steps are made short to see where it turns."""
    world = World(ROUND_TIPS, _finer(options))
    constants = box(MASS, (0.0, 0.0, -LEVER), FRICTION, SPINNING)
    target = pinch(world, constants, SQUEEZE, ANGLE)
    world.set_weight(1.0)
    angles, torques, levers = [roll_of(world)], list[float](), list[float]()
    while len(angles) < 2 or angles[-1] < angles[-2]:
        seen = grip(world)
        torques.append(seen.bearable(FRICTION, SPINNING))
        levers.append(float(np.linalg.norm(np.cross(centre_of_mass(world) - seen.point, seen.axis))))
        world.step(target)
        angles.append(roll_of(world))
    world.close()
    first, last = angles[0], min(angles)
    expected = _turning_point(first, GRAVITY * MASS * float(np.mean(levers)), float(np.mean(torques)))
    return Answer("angle that a hanging box loses in half a swing", "rad", first - expected, first + last)


_PARTS = 5


def _finer(options: SimulationOptions) -> SimulationOptions:
    """Policy steps a fifth as long."""
    return replace(options, substeps=options.substeps // _PARTS)


def _turning_point(first: float, weight: float, friction: float) -> float:
    """Angle on the other side at which the swing ends [rad], of two torques [N m]: weight times lever, and friction."""
    return float(brentq(lambda last: weight * (np.cos(last) - np.cos(first)) - friction * (first + last), 0.0, first))
