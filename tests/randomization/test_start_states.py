import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, tip_positions
from tactile_cube.randomization import Constant, Randomization, StartStates
from tactile_cube.simulation import EpisodeConstants

MOVED = Randomization(
    cube_position=(Constant(0.001), Constant(0.002), Constant(0.003)),
    cube_rotation=(Constant(0.01), Constant(0.02), Constant(0.1)),
)


def test_published_start_has_the_published_angles_and_an_aligned_cube() -> None:
    start = StartStates().of(DLR_HAND2).sample(Randomization(), EpisodeConstants(), np.random.default_rng(0))
    assert np.array_equal(start.angles, DLR_HAND2.start_angles)
    assert np.asarray(start.cube_quaternion) == pytest.approx([0, 0, 0, 1])


def test_cube_is_displaced_in_all_six_directions() -> None:
    start = StartStates().of(DLR_HAND2).sample(MOVED, EpisodeConstants(), np.random.default_rng(0))
    assert np.asarray(start.cube_position) == pytest.approx([0.001, 0.002, 0.003])
    assert Rotation.from_quat(start.cube_quaternion).as_euler("ZYX") == pytest.approx([0.1, 0.02, 0.01])


def test_on_a_table_the_cube_lies_flat() -> None:
    table = EpisodeConstants(table_height=-0.04)
    start = StartStates().of(DLR_HAND2).sample(MOVED, table, np.random.default_rng(0))
    assert np.asarray(start.cube_position) == pytest.approx([0.001, 0.002, 0.0])
    assert Rotation.from_quat(start.cube_quaternion).as_euler("ZYX") == pytest.approx([0.1, 0.0, 0.0])


def test_wide_starts_have_no_fingertip_inside_the_cube_and_all_near_it() -> None:
    poses = StartStates(poses=27, yaw_range=0.75, clearance=0.001).of(DLR_HAND2)
    gaps = []
    for yaw, angles in zip(poses.yaws, poses.angles, strict=True):
        tips = Rotation.from_euler("z", -yaw).apply(tip_positions(DLR_HAND2, angles))
        outside = np.linalg.norm(np.maximum(np.abs(tips) - 0.04, 0.0), axis=1)
        gaps.append(outside - DLR_HAND2.tip_radius)
    assert np.min(gaps) > 0.0005
    assert np.median(gaps) < 0.0015
    assert np.max(gaps) < 0.02
    assert np.ptp(poses.yaws) == pytest.approx(1.5)


def test_the_only_pose_for_another_object_stands_off_its_own_faces() -> None:
    poses = StartStates().of(DLR_HAND2, EpisodeConstants(cube_size=(0.08, 0.07, 0.08)))
    start = poses.sample(Randomization(), EpisodeConstants(), np.random.default_rng(0))
    assert np.asarray(start.cube_quaternion) == pytest.approx([0, 0, 0, 1])
    ring, middle = tip_positions(DLR_HAND2, start.angles)[:2]
    assert ring[1] == pytest.approx(-0.035 - DLR_HAND2.tip_radius - 1e-3, abs=1e-5)
    assert middle[0] == pytest.approx(0.040 + DLR_HAND2.tip_radius + 1e-3, abs=1e-5)


@pytest.mark.parametrize(("by", "upper"), [(0.02, False), (5.0, True)])
def test_start_angles_are_displaced_within_the_hardware_limits(by: float, upper: bool) -> None:
    start = (
        StartStates()
        .of(DLR_HAND2)
        .sample(Randomization(start_angles=Constant(by)), EpisodeConstants(), np.random.default_rng(0))
    )
    np.testing.assert_allclose(start.angles, DLR_HAND2.upper if upper else DLR_HAND2.start_angles + by)


def test_yaw_range_beyond_the_cubes_symmetry_is_refused() -> None:
    with pytest.raises(InputError, match=r"start\.yaw_range is 0\.9"):
        StartStates(poses=3, yaw_range=0.9)
