import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.evaluation.episode_record import ContactTable
from tactile_cube.evaluation.verdict import (
    EpisodeVerdict,
    cube_tilt,
    exploits,
    finger_history,
    free_spin,
    integrated_rotation,
    judge_episode,
    support,
    touched_faces,
    touching,
    verdict,
)
from tests.evaluation.synthetic import SPOTS, contacts, episode


@pytest.mark.parametrize(
    ("angle", "late", "changes", "lost", "expected"),
    [
        (5.0, 2.0, 8, False, EpisodeVerdict.REGRASPING),
        (2.5, 1.0, 1, False, EpisodeVerdict.STUCK_TWISTED),
        (1.5, 1.0, 4, False, EpisodeVerdict.STUCK_TWISTED),
        (2.2, 0.0, 4, False, EpisodeVerdict.STUCK_TWISTED),
        (0.3, 0.1, 4, False, EpisodeVerdict.HOLDING),
        (-2.0, -1.0, 0, False, EpisodeVerdict.HOLDING),
        (1.8, 0.5, 0, True, EpisodeVerdict.SPUN_AND_DROPPED),
        (6.0, 2.0, 9, True, EpisodeVerdict.DROPPED),
        (0.1, 0.0, 0, True, EpisodeVerdict.DROPPED),
    ],
)
def test_verdicts_follow_their_definitions(angle, late, changes, lost, expected) -> None:
    assert verdict(angle, late, changes, lost=lost) == expected


def test_judging_a_regrasping_episode() -> None:
    result = judge_episode(episode(angle=5.0), episode=3, seed=17)
    assert (result.episode, result.seed, result.verdict) == (3, 17, EpisodeVerdict.REGRASPING)
    assert result.final_angle == pytest.approx(5.0)
    assert result.late_angle == pytest.approx(2.0)
    assert result.duration == pytest.approx(10.0)
    assert result.face_changes == (3, 3, 3, 3)
    assert result.faces_visited == (4, 4, 4, 4)
    assert result.kept


def test_angle_and_time_count_from_the_start_and_the_largest_tilt_is_told() -> None:
    rock = np.outer(0.6 * np.sin(np.linspace(0.0, np.pi, 101)), [1.0, 0.0, 0.0])
    begun = {"theta": 7.0 + np.linspace(0.0, 0.2, 101), "time": 2.0 + 0.1 * np.arange(101)}
    result = judge_episode(episode(cube_quaternion=Rotation.from_rotvec(rock).as_quat(), **begun))
    assert (result.final_angle, result.late_angle, result.duration) == pytest.approx((0.2, 0.08, 10.0))
    assert result.max_tilt == pytest.approx(0.6)
    assert (result.verdict, result.exploits) == (EpisodeVerdict.HOLDING, ())


@pytest.mark.parametrize("ending", ["time_limit", "dropped", "left_range", "tilted", "lifted", "faulty"])
def test_every_early_ending_loses_a_cube_that_twists_with_the_fingers(ending: str) -> None:
    result, kept = judge_episode(episode(angle=1.6, carried=True, ending=ending)), ending == "time_limit"
    assert result.verdict == (EpisodeVerdict.STUCK_TWISTED if kept else EpisodeVerdict.SPUN_AND_DROPPED)
    assert result.kept == kept


def test_an_episode_without_any_touch_is_plain_data_too() -> None:
    result = judge_episode(episode(steps=10, touch=np.zeros((11, 4), dtype=bool)))
    assert json.loads(json.dumps(result.as_dict()))["kept"] is True
    assert result.faces_visited == (0, 0, 0, 0)


def test_the_cubes_height_is_that_of_the_last_part() -> None:
    height = np.zeros((101, 3))
    height[:, 2] = np.where(np.arange(101) < 60, 0.01, 0.03)
    assert judge_episode(episode(cube_position=height)).rise == pytest.approx(0.02)


def test_honest_turning_is_not_suspected() -> None:
    assert exploits(episode(angle=5.0)) == []


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, -0.6, 0.8)])
def test_integrated_rotation_passes_full_turns_about_the_tasks_axis(axis: tuple[float, ...]) -> None:
    theta = np.linspace(0.0, 15.0, 101)
    turn = Rotation.from_rotvec(np.outer(-theta, axis)) * Rotation.from_rotvec([0.1, 0.2, 0.3])
    record = episode(theta=theta, cube_quaternion=turn.as_quat(), axis=axis)
    np.testing.assert_allclose(integrated_rotation(record), theta, atol=1e-9)
    assert "angle_mismatch" not in exploits(record)


def test_a_leaning_cube_that_turns_about_its_own_axis_is_not_suspected() -> None:
    turned = np.linspace(0.0, 10 * np.pi, 401)
    lean = Rotation.from_rotvec([0.3, 0.0, 0.0])
    quaternion = (lean * Rotation.from_rotvec(np.outer(-turned, [0.0, 0.0, 1.0]))).as_quat()
    record = episode(angle=10 * np.pi, steps=400, cube_quaternion=quaternion)
    np.testing.assert_allclose(integrated_rotation(record)[-1], np.cos(0.3) * turned[-1])
    assert exploits(record) == []


def test_an_angle_that_the_cube_did_not_turn_is_found() -> None:
    assert exploits(episode(angle=2.0, theta=np.linspace(0.0, 8.0, 101))) == ["angle_mismatch"]


def test_a_jump_of_a_quarter_turn_is_found() -> None:
    turned = np.where(np.arange(101) < 50, 0.0, np.pi / 2)
    quaternion = Rotation.from_rotvec(np.outer(-turned, [0.0, 0.0, 1.0])).as_quat()
    assert "angle_jump" in exploits(episode(theta=turned, cube_quaternion=quaternion))


def test_a_cube_that_spins_without_fingers_is_flung() -> None:
    touch = np.ones((101, 4), dtype=bool)
    touch[40:, 1:] = False
    record = episode(angle=5.0, touch=touch)
    assert exploits(record) == ["flung"]
    np.testing.assert_allclose(free_spin(record), 3.0, atol=0.1)


@pytest.mark.parametrize("constants", [{"table_height": -0.04}, {"palm_contact": 1.0}])
def test_on_a_table_or_in_a_palm_one_finger_may_push(constants: dict[str, float | str]) -> None:
    touch = np.ones((101, 4), dtype=bool)
    touch[:, 1:] = False
    assert exploits(episode(angle=5.0, touch=touch, constants=constants)) == []
    touch[50:, 0] = False
    assert exploits(episode(angle=5.0, touch=touch, constants=constants)) == ["flung"]


def test_a_tumbled_cube_is_found_unless_it_was_falling() -> None:
    quaternion = Rotation.from_rotvec(np.outer(np.linspace(0.0, 1.0, 101), [1.0, 0.0, 0.0])).as_quat()
    kept = episode(theta=np.zeros(101), cube_quaternion=quaternion)
    np.testing.assert_allclose(cube_tilt(kept)[-1], 1.0)
    assert "tumbled" in exploits(kept)
    fallen = episode(theta=np.zeros(101), cube_quaternion=quaternion, ending="dropped")
    assert "tumbled" not in exploits(fallen)


def test_deep_penetration_is_found() -> None:
    table = contacts(np.ones((101, 4), dtype=bool), np.tile(SPOTS, (101, 1, 1)), distance=-0.01)
    assert exploits(episode(angle=0.0, contacts=table)) == ["penetration"]


def test_standing_fingers_visit_the_faces_that_come_by() -> None:
    """The cube turns a full turn in -z under the ring finger at -y, which meets -y, +x, +y, -x and -y again."""
    history = finger_history(episode(angle=2 * np.pi), 0)
    assert history.faces == ("-y", "+x", "+y", "-x", "-y")
    assert history.face_changes == 4
    assert history.lifts == 0


def test_carried_fingers_stay_on_their_faces() -> None:
    record = episode(angle=1.5, carried=True)
    assert [finger_history(record, finger).faces for finger in range(4)] == [("-y",), ("+x",), ("+y",), ("-x",)]


def test_a_lift_counts_when_the_finger_comes_back() -> None:
    touch = np.ones((101, 4), dtype=bool)
    touch[20:25, 1] = touch[50:51, 1] = False  # comes back twice
    touch[80:, 2] = False  # never comes back
    touch[:10, 3] = False  # had not touched before
    record = episode(angle=0.0, touch=touch)
    assert [finger_history(record, finger).lifts for finger in range(4)] == [0, 2, 0, 0]


def test_a_brush_below_the_threshold_is_no_touch() -> None:
    spots = np.tile(SPOTS, (11, 1, 1))
    record = episode(steps=10, contacts=contacts(np.ones((11, 4), dtype=bool), spots, force=0.01))
    assert not touching(record).any()


def test_faces_are_told_apart_on_a_cuboid() -> None:
    """On a long cuboid a point far along x, but not at its end, belongs to the long side."""
    touch = np.zeros((2, 4), dtype=bool)
    touch[:, 0] = True
    spots = np.zeros((2, 4, 3))
    spots[:, 0] = [0.05, -0.04, 0.0]
    size = np.array([0.2, 0.08, 0.08])
    record = episode(angle=0.0, steps=1, contacts=contacts(touch, spots), cube_size=size)
    assert touched_faces(record).tolist() == [3, 3]


def table(*rows: tuple[int, int, bool, float]) -> ContactTable:
    """Contacts of step, finger, whether its tip touches, and normal force [N]."""
    step, finger, tip, force = (np.array(column) for column in zip(*rows, strict=True))
    nowhere = np.zeros((len(rows), 3))
    return ContactTable(step, finger, tip, nowhere, nowhere, force, np.zeros(len(rows)))


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ([(1, 0, True, 1.0), (1, 1, True, 1.0), (1, 2, True, 2.0)], (0.5, 0.0, 0.0)),
        ([(1, 0, True, 1.0), (1, 0, True, 1.0), (1, 1, True, 1.0)], (0.0, 0.0, 0.0)),  # two tips, three points
        ([(1, 0, True, 1.0), (1, 1, True, 1.0), (1, 2, False, 2.0)], (0.0, 0.5, 0.5)),
        ([(1, 0, True, 3.0), (2, 0, False, 0.5), (2, 3, False, 0.5)], (0.0, 0.5, 0.25)),
        ([(0, 0, False, 9.0), (2, 0, True, 1.0)], (0.0, 0.0, 0.0)),  # the start does not count
        ([(1, 0, False, 0.01)], (0.0, 0.0, 1.0)),  # a brush bears all there is, and is no touch
        ([(1, 0, False, 0.015), (1, 0, False, 0.015)], (0.0, 0.5, 1.0)),  # two points of one touch
        ([(1, 0, True, 0.0)], (0.0, 0.0, 0.0)),
    ],
)
def test_what_bears_the_cube_in_two_steps(rows, expected) -> None:
    found = support(episode(steps=2, contacts=table(*rows)))
    assert (found["tip_support"], found["link_contact"], found["link_force_share"]) == expected
