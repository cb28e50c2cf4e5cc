import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.env import cube_pose


@pytest.mark.parametrize("angles", [(0.3, -0.2, 0.1), (-2.9, 0.4, -0.5), (0.0, 0.0, 0.0)])
def test_pose_takes_the_rotation_apart_as_yaw_pitch_roll(angles: tuple[float, float, float]) -> None:
    quaternion = Rotation.from_euler("ZYX", angles).as_quat()
    pose = cube_pose((1.0, 2.0, 3.0), quaternion.tolist())
    assert (pose.theta, pose.phi, pose.psi) == pytest.approx(angles)
    assert pose[:3] == (1.0, 2.0, 3.0)


def test_tilt_is_the_angle_of_the_vertical_axis_whatever_the_yaw() -> None:
    for yaw in (0.0, 1.0, -2.5):
        quaternion = (Rotation.from_euler("z", yaw) * Rotation.from_rotvec([0.3, 0.4, 0.0])).as_quat()
        assert cube_pose((0, 0, 0), quaternion.tolist()).tilt == pytest.approx(0.5)


def test_theta_is_unwrapped_step_by_step_over_several_turns() -> None:
    theta = 0.0
    for angle in np.arange(0.0, 15.0, 0.1):
        quaternion = Rotation.from_euler("z", angle).as_quat()
        theta = cube_pose((0, 0, 0), quaternion.tolist(), theta).theta
    assert theta == pytest.approx(14.9)
    assert theta > 4 * math.pi
