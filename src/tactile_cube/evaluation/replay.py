"""A start that is nearly, but not quite, the recorded one: what open-loop replay has to live with."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.env import RotationEnv
from tactile_cube.simulation import Start

POSITION_SPREAD = 0.0005
"""Standard deviation of the cube's displacement in x and y [m]: half of what the start is randomised by."""
YAW_SPREAD = 0.01
"""Standard deviation of its turn about the vertical [rad]."""


class NearlyEqualStart:
    """Displaces the cube a little before the first policy step; everything else of the episode stays."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self._shift = np.append(rng.normal(0.0, POSITION_SPREAD, 2), 0.0)
        self._turn = Rotation.from_euler("z", rng.normal(0.0, YAW_SPREAD))

    def __call__(self, env: RotationEnv, step: int) -> None:
        """Start the world anew with the displaced cube when `step` is 0."""
        if step > 0:
            return
        world = env.world
        turned = self._turn * Rotation.from_quat(world.cube_quaternion)
        start = Start(
            angles=np.array(world.q),
            cube_position=np.array(world.cube_position) + self._shift,
            cube_quaternion=turned.as_quat(),
        )
        world.reset(env.constants, start)
