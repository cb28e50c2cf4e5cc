"""Where an episode starts: the cube under the hand, the fingers around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand import Hand, grasp_angles
from tactile_cube.randomization.distributions import sample
from tactile_cube.randomization.randomization import Randomization
from tactile_cube.simulation import EpisodeConstants, Start

Array = NDArray[np.float64]
MOST = 10_000
"""Start poses; inverse kinematics is solved for each."""


@dataclass(frozen=True)
class StartStates:
    """Which start poses of cube and fingers there are; each episode picks one and displaces it at random.

    Attributes:
        poses: number of poses; 1 is the published start.
        yaw_range: with several poses the cube is turned by -yaw_range .. yaw_range about the vertical [rad].
        clearance: the fingertips are then this far off their faces, by inverse kinematics [m].
    """

    poses: int = 1
    yaw_range: float = 0.0
    clearance: float = 0.001

    def __post_init__(self) -> None:
        """Refuses values without a meaning."""
        if not 1 <= self.poses <= MOST:
            raise InputError(f"start.poses is {self.poses}; give 1 to {MOST}")
        if not 0.0 <= self.yaw_range < 0.25 * np.pi:
            raise InputError(f"start.yaw_range is {self.yaw_range} rad; give 0 to below pi/4, beyond it faces repeat")

    def of(self, hand: Hand, constants: EpisodeConstants | None = None) -> StartPoses:
        """The start poses of `hand` with the object of `constants`; None: the nominal cube."""
        known = EpisodeConstants() if constants is None else constants
        nominal = known.object_shape == "box" and np.array_equal(known.cube_size, EpisodeConstants().cube_size)
        if self.poses == 1 and nominal:
            return StartPoses(hand, np.zeros(1), np.asarray(hand.start_angles, dtype=np.float64)[None])
        yaws = np.linspace(-self.yaw_range, self.yaw_range, self.poses) if self.poses > 1 else np.zeros(1)
        size, shape = np.asarray(known.cube_size), known.object_shape
        turned = Rotation.from_euler("z", yaws[:, None]).as_quat()
        angles = [grasp_angles(hand, size, np.zeros(3), turn, self.clearance, shape) for turn in turned]
        return StartPoses(hand, yaws, np.stack(angles))


@dataclass(frozen=True)
class StartPoses:
    """A table of start poses.

    Attributes:
        hand: the hand.
        yaws: angles of the cube about the vertical `(poses,)` [rad].
        angles: joint angles that go with them `(poses, joints)` [rad].
    """

    hand: Hand
    yaws: Array
    angles: Array

    def sample(self, randomization: Randomization, constants: EpisodeConstants, rng: np.random.Generator) -> Start:
        """Draws a pose and displaces it.

        A cube on a table rests on it: its height and its tilt are then not displaced.
        """
        pose = int(rng.integers(len(self.yaws)))
        position = np.array([float(sample(d, rng)) for d in randomization.cube_position])
        turn = np.array([float(sample(d, rng)) for d in randomization.cube_rotation])
        angles = self.angles[pose] + sample(randomization.start_angles, rng, (self.hand.joints,))
        if constants.table_height is not None:
            position[2] = 0.0
            turn[:2] = 0.0
        return Start(
            angles=np.clip(angles, self.hand.lower, self.hand.upper),
            cube_position=position,
            cube_quaternion=Rotation.from_euler("ZYX", [self.yaws[pose] + turn[2], turn[1], turn[0]]).as_quat(),
        )
