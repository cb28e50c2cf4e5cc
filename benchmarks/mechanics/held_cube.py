"""Speed and accuracy of numerical options: deviation of a held and a twisted cube from convergence."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.engine import SimulationOptions
from tactile_cube.simulation.world import World

Array = NDArray[np.float64]

REFERENCE = SimulationOptions(dt=5e-4, substeps=200, solver_iterations=500)
"""Options whose results stand for convergence."""
SQUEEZE = 0.01
"""Depth of the fingertips' targets inside the cube's faces [m]."""
TWIST = -0.5
"""Yaw to which the targets turn [rad], in 3 s."""
_HOLD_STEPS, _TWIST_STEPS, _REST_STEPS = 100, 30, 20


@dataclass(frozen=True)
class Accuracy:
    """Speed and accuracy of one set of options.

    Attributes:
        creep: Way of a held cube from 5 s to 10 s [m].
        rest: Where the held cube is after 10 s (3,) [m].
        tip_forces: Normal force of each finger on the held cube (4,) [N].
        coupling_error: Largest difference between q4 and q3 while holding and twisting [rad].
        twist: Yaw of the cube after a scripted twist [rad].
        steps_per_second: Policy steps per second of processor time while holding, on one core (median).
        fault: What went wrong with the physics, "" if nothing.
    """

    creep: float
    rest: Array
    tip_forces: Array
    coupling_error: float
    twist: float
    steps_per_second: float
    fault: str


def measure_accuracy(options: SimulationOptions, constants: EpisodeConstants | None = None) -> Accuracy:
    """Holds a cube for 10 s at full gravity, then twists it, and measures; deterministic but for the speed."""
    world = World(options=options)
    world.reset(constants or EpisodeConstants(), Start(DLR_HAND2.start_angles))
    positions, seconds, stretch, target = [], [], 0.0, _targets(0.0)
    for _ in range(_HOLD_STEPS):
        began = time.process_time()
        world.step(target)
        seconds.append(time.process_time() - began)
        positions.append(world.cube_position.copy())
        stretch = max(stretch, _stretch(world))
    forces = _tip_forces(world)
    for k in range(_TWIST_STEPS + _REST_STEPS):
        world.step(_targets(TWIST * min(1.0, (k + 1) / _TWIST_STEPS)))
        stretch = max(stretch, _stretch(world))
    result = Accuracy(
        creep=float(np.linalg.norm(positions[-1] - positions[_HOLD_STEPS // 2 - 1])),
        rest=positions[-1],
        tip_forces=forces,
        coupling_error=stretch,
        twist=float(Rotation.from_quat(world.cube_quaternion).as_euler("ZYX")[0]),
        steps_per_second=1.0 / float(np.median(seconds)),
        fault=world.fault,
    )
    world.close()
    return result


def _targets(yaw: float) -> Array:
    """Fingertips `SQUEEZE` inside the faces of a cube turned by a yaw [rad]: joint angles (12,) [rad]."""
    quaternion = Rotation.from_euler("z", yaw).as_quat()
    return grasp_angles(DLR_HAND2, [0.08] * 3, [0.0, 0.0, 0.0], quaternion, -SQUEEZE)


def _stretch(world: World) -> float:
    angles = world.all_joint_angles.reshape(-1, 4)
    return float(np.abs(angles[:, 3] - angles[:, 2]).max())


def _tip_forces(world: World) -> Array:
    forces = {finger.name: 0.0 for finger in world.hand.fingers}
    for contact in world.contacts():
        if contact.other == "cube" and contact.finger in forces:
            forces[contact.finger] += contact.force
    return np.array(list(forces.values()))
