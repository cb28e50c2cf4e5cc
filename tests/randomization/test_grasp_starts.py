from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, tip_positions
from tactile_cube.randomization import Constant, Grasps, GraspStarts, Randomization, StartStates
from tactile_cube.randomization.grasp_starts import SHIPPED
from tactile_cube.simulation import EpisodeConstants, World


def few(count: int = 3, **changed: object) -> Grasps:
    """Grasps that are told apart by the height of the object."""
    rows = np.arange(count, dtype=np.float64)[:, None]
    upright = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    angles = np.tile(DLR_HAND2.start_angles, (count, 1))
    whole = Grasps(angles, angles + 0.05, rows * [0.0, 0.0, 1e-3], upright, DLR_HAND2.name, "box", (0.08,) * 3)
    return replace(whole, **changed)  # type: ignore[arg-type]


def test_what_is_saved_comes_back_and_equal_grasps_give_equal_files(tmp_path: Path) -> None:
    few().save(tmp_path / "one.npz")
    few().save(tmp_path / "two.npz")
    back = Grasps.load(tmp_path / "one.npz")
    assert back.targets == pytest.approx(few().targets, abs=1e-6)
    assert (back.hand, back.shape, back.size) == (DLR_HAND2.name, "box", (0.08,) * 3)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()


def test_a_start_is_one_of_the_grasps_as_the_sensors_read_it(tmp_path: Path) -> None:
    few().save(tmp_path / "grasps.npz")
    table = GraspStarts(str(tmp_path / "grasps.npz")).of(DLR_HAND2)
    shifted = EpisodeConstants(joint_offset=0.01)
    starts = [table.sample(Randomization(), shifted, np.random.default_rng(seed)) for seed in range(40)]
    assert {round(float(start.cube_position[2]), 4) for start in starts} == {0.0, 0.001, 0.002}
    target = starts[0].target
    assert target is not None
    assert target == pytest.approx(DLR_HAND2.start_angles + 0.06, abs=1e-6)


def test_the_rest_of_the_episodes_start_as_published(tmp_path: Path) -> None:
    few().save(tmp_path / "grasps.npz")
    table = GraspStarts(str(tmp_path / "grasps.npz"), share=0.25).of(DLR_HAND2)
    starts = [table.sample(Randomization(), EpisodeConstants(), np.random.default_rng(seed)) for seed in range(400)]
    assert np.mean([start.target is not None for start in starts]) == pytest.approx(0.25, abs=0.06)


def test_shipped_grasps_are_of_every_yaw_and_some_have_a_finger_on_the_next_face() -> None:
    grasps = Grasps.load(SHIPPED)
    yaw = Rotation.from_quat(grasps.quaternions).as_euler("ZYX")[:, 0]
    counts, _ = np.histogram(yaw, bins=6, range=(-0.25 * np.pi, 0.25 * np.pi))
    assert counts.min() > 0.05 * len(yaw)
    tips = np.stack([tip_positions(DLR_HAND2, angles) for angles in grasps.angles])
    on_cube = np.stack([Rotation.from_euler("z", -turn).apply(tip) for turn, tip in zip(yaw, tips, strict=True)])
    quarter = np.round(np.arctan2(on_cube[..., 1], on_cube[..., 0]) / (0.5 * np.pi)) % 4
    assert np.mean(np.any(quarter != [3, 0, 1, 2], axis=1)) > 0.15


def test_a_shipped_grasp_holds_the_full_weight_from_the_first_step() -> None:
    table = GraspStarts().of(DLR_HAND2)
    constants = EpisodeConstants(filter_time=0.1, gravity_onset=0, tip_spinning_friction=0.003)
    world, moved = World(), []
    for seed in range(6):
        start = table.sample(Randomization(), constants, np.random.default_rng(seed))
        world.reset(constants, start)
        for _ in range(10):
            world.step(np.asarray(start.target))
        moved.append(float(np.linalg.norm(world.cube_position - start.cube_position)))
    assert np.median(moved) < 0.001
    assert np.max(moved) < 0.005


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"hand": "three_finger"}, "grasps of hand three_finger"),
        ({"shape": "cylinder"}, "a cylinder of"),
        ({"size": (0.07,) * 3}, r"\[0\.07"),
        ({"positions": np.zeros((2, 3))}, r"positions is \(2, 3\)"),
        ({"targets": np.full((3, 12), np.nan)}, "targets, row 0, is not finite"),
    ],
)
def test_grasps_that_do_not_fit_are_refused(tmp_path: Path, changed: dict[str, object], said: str) -> None:
    few(**changed).save(tmp_path / "grasps.npz")
    with pytest.raises(InputError, match=said):
        GraspStarts(str(tmp_path / "grasps.npz")).of(DLR_HAND2)


def test_what_is_no_file_of_grasps_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.npz").write_text("nothing")
    np.savez(tmp_path / "other.npz", angles=np.zeros((1, 12)))
    told = {"none.npz": "no such file", "text.npz": "not a complete NPZ file", "other.npz": "no file of grasps"}
    for name, said in told.items():
        with pytest.raises(InputError, match=said):
            GraspStarts(str(tmp_path / name)).of(DLR_HAND2)
    with pytest.raises(InputError, match=r"start\.share is 0"):
        GraspStarts(share=0.0)


def test_a_table_is_refused() -> None:
    table = GraspStarts().of(DLR_HAND2)
    with pytest.raises(InputError, match="start=wide_yaw"):
        table.sample(Randomization(), EpisodeConstants(table_height=-0.04), np.random.default_rng(0))


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
