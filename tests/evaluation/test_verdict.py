import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.evaluation.verdict import EpisodeVerdict, judge_episode, verdict
from tests.evaluation.synthetic import episode


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
def test_verdicts_follow_their_definitions(
    angle: float, late: float, changes: int, lost: bool, expected: EpisodeVerdict
) -> None:
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


def test_judging_fingers_that_twist_with_the_cube() -> None:
    assert judge_episode(episode(angle=1.6, carried=True)).verdict == EpisodeVerdict.STUCK_TWISTED


@pytest.mark.parametrize("ending", ["dropped", "left_range", "tilted", "lifted", "faulty"])
def test_every_early_ending_loses_the_cube(ending: str) -> None:
    result = judge_episode(episode(angle=1.6, carried=True, ending=ending))
    assert result.verdict == EpisodeVerdict.SPUN_AND_DROPPED
    assert not result.kept


def test_a_result_is_plain_data() -> None:
    result = judge_episode(episode(steps=10, touch=np.zeros((11, 4), dtype=bool)))
    assert json.loads(json.dumps(result.as_dict()))["kept"] is True


def test_the_cubes_height_is_that_of_the_last_part() -> None:
    height = np.zeros((101, 3))
    height[:, 2] = np.where(np.arange(101) < 60, 0.01, 0.03)
    assert judge_episode(episode(cube_position=height)).rise == pytest.approx(0.02)
