"""The work that simulations are compared on: four fingers hold the cube at full weight and turn it to and fro."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World

Array = NDArray[np.float64]

SQUEEZE = 0.01
"""Depth of the fingertips' targets inside the cube's faces [m]."""
YAW, PERIOD = 0.2, 40
"""The targets turn to and fro by so much [rad], once in so many policy steps."""
SETTLE, HOLD = 50, 50
"""Policy steps before and while the cube's creep is measured."""


class Holding(Protocol):
    """A simulation of the hand around the cube, at the start of an episode."""

    @property
    def cube_position(self) -> Array:
        """Centre of the cube (3,) [m]."""

    def step(self, q_n: Array, /) -> None:
        """One policy step of 0.1 s towards desired joint angles (12,) [rad]."""

    def close(self) -> None:
        """Ends the simulation."""


def targets(yaw: float) -> Array:
    """Joint angles (12,) [rad] that press on a cube turned by `yaw` [rad]."""
    quaternion = Rotation.from_euler("z", yaw).as_quat()
    return grasp_angles(DLR_HAND2, [0.08] * 3, [0.0, 0.0, 0.0], quaternion, -SQUEEZE)


def motion() -> Iterator[Array]:
    """Targets of the to and fro, for ever."""
    angles = YAW * np.sin(2.0 * np.pi * np.arange(PERIOD) / PERIOD)
    return itertools.cycle([targets(float(yaw)) for yaw in angles])


def creep(holding: Holding) -> float:
    """Way of the held cube from 5 s to 10 s after the start [m]; 1 or more where it was lost."""
    still = targets(0.0)
    for _ in range(SETTLE):
        holding.step(still)
    before = holding.cube_position.copy()
    for _ in range(HOLD):
        holding.step(still)
    return float(np.linalg.norm(holding.cube_position - before))


def our_world(options: SimulationOptions, effects: tuple[str, ...] = ()) -> World:
    """This package's world at the start, with catalogue effects on every joint at their typical values."""
    from tactile_cube.drivetrain.effects import resolve

    found = resolve(effects, DLR_HAND2.joint_names)
    made = [effect(joint, **{p.name: p.typical for p in effect.parameters}) for effect, joint in found]
    world = World(options=options, effects=made)
    world.reset(EpisodeConstants(), Start(DLR_HAND2.start_angles))
    return world
