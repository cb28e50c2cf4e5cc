"""Impact: a finger without torque runs into a cube that floats, smooth and without a rebound.

The impulse along the normal that brings both points to the same speed is v / (1 / m + 1 / M): m is what the fingertip
weighs along the normal, rotors included, 1 / (J A^-1 J'), and 1 / M = 1 / mass + (r x n)^2 / inertia of the cube.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.mechanics.case import Answer
from tactile_cube.hand import DLR_HAND2, grasp_angles, tip_positions
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.engine import SimulationOptions
from tactile_cube.simulation.world import World

Array = NDArray[np.float64]

SPEED = 0.2
"""Speed of the fingertip along the normal [m/s]."""
MASS, SIZE = 0.05, 0.08
FINGER = 2
_GAP, _AWAY = 1e-3, 2e-2
_DURATION = 0.02
_NOTHING = 1e-9


def impact(options: SimulationOptions) -> Answer:
    """Speed of the cube's centre 20 ms after the finger set out; it arrives after 5 ms."""
    world = World(options=SimulationOptions(options.engine, options.dt, round(_DURATION / options.dt)))
    own = DLR_HAND2.of_finger(FINGER)
    angles, normal = _angles(own), -DLR_HAND2.fingers[FINGER].face
    jacobian = _jacobian(angles)[:, own]
    velocities = np.zeros(len(angles))
    velocities[own] = np.linalg.solve(jacobian, SPEED * normal)
    constants = EpisodeConstants(
        gravity=_NOTHING,
        kp=_NOTHING,
        kd=0.0,
        static_friction=0.0,
        cube_size=SIZE,
        cube_mass=MASS,
        tip_friction=0.0,
        link_friction=0.0,
    )
    world.reset(constants, Start(angles, velocities=velocities))
    world.step(angles)
    measured = float(world.cube_linear_velocity @ normal)
    tip = tip_positions(DLR_HAND2, angles)[FINGER]
    world.close()
    inertia = _inertia(angles[own], np.asarray(constants.reflected_inertia)[own])
    of_finger = float(normal @ jacobian @ np.linalg.solve(inertia, jacobian.T @ normal))
    of_cube = 1.0 / MASS + float(np.sum(np.cross(tip, normal) ** 2)) / (MASS * SIZE**2 / 6.0)
    return Answer("speed of a cube that a finger hits", "m/s", SPEED / (of_finger + of_cube) / MASS, measured)


def _angles(own: slice) -> Array:
    """Joint angles (12,) [rad]: one tip before its face, the others away."""
    size, centre, upright = [SIZE] * 3, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]
    near, away = (grasp_angles(DLR_HAND2, size, centre, upright, gap) for gap in (_GAP, _AWAY))
    away[own] = near[own]
    return away


def _jacobian(angles: Array) -> Array:
    """Velocity of the fingertip's centre per joint velocity (3, 12), by central differences."""
    width = 1e-6
    rows = [
        tip_positions(DLR_HAND2, angles + step)[FINGER] - tip_positions(DLR_HAND2, angles - step)[FINGER]
        for step in width * np.eye(len(angles))
    ]
    return np.stack(rows, axis=1) / (2.0 * width)


def _inertia(q: Array, rotors: Array) -> Array:
    """Inertia that the drives feel, rotors included (3, 3) [kg m^2]."""
    return RigidBodyTree.from_urdf(DLR_HAND2.finger_urdf(0)).actuated_mass_matrix(q) + np.diag(rotors)
