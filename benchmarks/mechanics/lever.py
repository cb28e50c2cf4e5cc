"""Twist: the weight at which a box slips between two tips when it grows at a lever beside their axis.

Sideways force f and torque t about the normal share the friction of a tip under the normal force N, as on an ellipsoid:
(f / (mu N))^2 + (t / (s N))^2 <= 1. Two tips with half the weight W each, at a lever L, bear

    W = 2 N / sqrt(1 / mu^2 + L^2 / s^2)

Source of the ellipsoid: Howe and Cutkosky, "Practical force-motion models for sliding manipulation", 1996.
"""

from __future__ import annotations

import numpy as np

from benchmarks.mechanics.case import Answer
from benchmarks.mechanics.pinch import (
    GRAVITY,
    ROUND_TIPS,
    box,
    centre_of_mass,
    grip,
    pinch,
    roll_of,
)
from tactile_cube.simulation.engine import SimulationOptions
from tactile_cube.simulation.world import World

SQUEEZE = 0.002
MASS, FRICTION, SPINNING = 0.1, 0.9, 3e-3
_LIGHT, _HEAVY, _STEPS = 0.5, 2.0, 100
"""The weight grows from and to these shares of what two tips bear at that lever, within 10 s."""
_SPINS, _SLIDES = 0.03, 3e-3
"""Beyond what the fingers give way: turn of the box [rad], its speed [m/s]."""
_STEADY = 5
"""Steps over which the grip is averaged: Bullet's normal forces flicker by a tenth."""


def twist(options: SimulationOptions) -> Answer:
    """Almost pure spinning: a lever of 40 mm, more than ten times s / mu."""
    return _slip(options, "weight that two tips bear at a lever of 40 mm", 0.040)


def slide_and_spin(options: SimulationOptions) -> Answer:
    """Sliding and spinning in equal shares: a lever of s / mu."""
    return _slip(options, "weight that two tips bear at a lever of 3.3 mm", SPINNING / FRICTION)


def _slip(options: SimulationOptions, quantity: str, lever: float) -> Answer:
    """Lets the weight grow until the box spins or slides; the grip is that of the steps before."""
    world = World(ROUND_TIPS, options)
    target = pinch(world, box(MASS, (0.0, lever, 0.0), FRICTION, SPINNING), SQUEEZE)
    start, bearable, borne = roll_of(world), [_bearable(world)], 0.0
    for weight in bearable[0] * np.linspace(_LIGHT, _HEAVY, _STEPS):
        before = world.cube_position.copy()
        world.set_weight(float(weight) / (GRAVITY * MASS))
        world.step(target)
        speed = float(np.linalg.norm(world.cube_position - before)) / options.policy_dt
        if abs(roll_of(world) - start) > _SPINS or speed > _SLIDES:
            break
        borne = float(weight)
        bearable.append(_bearable(world))
    world.close()
    return Answer(quantity, "N", float(np.mean(bearable[-_STEADY:])), borne)


def _bearable(world: World) -> float:
    """Weight that the present grip should bear [N]."""
    seen = grip(world)
    lever = seen.lever(centre_of_mass(world))
    return float(2.0 * seen.normal.mean() / np.hypot(1.0 / FRICTION, lever / SPINNING))
