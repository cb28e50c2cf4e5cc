import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.env import Task, cube_pose
from tactile_cube.env.task import frame_along, seen_along
from tactile_cube.errors import InputError


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


@pytest.mark.parametrize(
    ("axis", "along"), [("x", (1, 0, 0)), ("y", (0, 1, 0)), ("z", (0, 0, 1)), ((3.0, 4.0, -12.0), (3, 4, -12))]
)
def test_a_turn_about_the_tasks_axis_is_theta_and_any_other_is_tilt(axis, along) -> None:
    vector = Task("table", axis=axis).axis_vector()
    np.testing.assert_allclose(vector, np.array(along) / np.linalg.norm(along))
    turned = seen_along(frame_along(vector), Rotation.from_rotvec(0.7 * vector).as_quat().tolist())
    pose = cube_pose((0, 0, 0), turned)
    assert (pose.theta, pose.tilt) == pytest.approx((0.7, 0.0), abs=1e-7)
    across = np.cross(vector, [0.3, 0.1, 0.9])
    tilted = Rotation.from_rotvec(0.2 * across / np.linalg.norm(across)).as_quat().tolist()
    assert cube_pose((0, 0, 0), seen_along(frame_along(vector), tilted)).tilt == pytest.approx(0.2)


def test_about_the_vertical_nothing_is_computed_anew() -> None:
    quaternion = [0.1, 0.2, 0.3, 0.9]
    assert seen_along(frame_along((0.0, 0.0, 1.0)), quaternion) is quaternion


@pytest.mark.parametrize("axis", ["up", (0.0, 0.0, 0.0), (1.0, 0.0)])
def test_what_is_no_direction_is_refused(axis: str | tuple[float, ...]) -> None:
    with pytest.raises(InputError, match="give x, y, z or three numbers"):
        Task("table", axis=axis)
