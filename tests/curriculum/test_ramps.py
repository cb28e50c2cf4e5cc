import pytest

from tactile_cube.curriculum import LinearCurriculum, NoCurriculum, PerformanceCurriculum
from tactile_cube.env import Conditions
from tactile_cube.errors import InputError

FINAL = Conditions(filter_time=0.5, gravity_scale=1.0, penalty_scale=1.0)


def test_linear_curriculum_has_the_published_ramp() -> None:
    curriculum = LinearCurriculum()
    assert curriculum.conditions(0, 9.0, FINAL) == Conditions(0.12, 0.05, 1.0)
    assert curriculum.conditions(2_000_000, 9.0, FINAL) == Conditions(0.12, 0.05, 1.0)
    middle = curriculum.conditions(4_000_000, 0.0, FINAL)
    assert (middle.filter_time, middle.gravity_scale) == pytest.approx((0.31, 0.525))
    assert curriculum.conditions(6_000_000, 0.0, FINAL) == FINAL
    assert curriculum.conditions(9_000_000, 0.0, FINAL) == FINAL


def test_performance_curriculum_follows_the_angle_up_and_down() -> None:
    curriculum = PerformanceCurriculum(low=1.0, high=3.0, penalty_scale=0.2)
    scales = [curriculum.conditions(0, angle, FINAL).penalty_scale for angle in (0.0, 2.0, 5.0, 2.0)]
    assert scales == pytest.approx([0.2, 0.6, 1.0, 0.6])


def test_ramps_left_out_keep_the_tasks_values() -> None:
    curriculum = LinearCurriculum(filter_time=None, gravity_scale=None, penalty_scale=0.5)
    assert curriculum.conditions(0, 0.0, FINAL) == Conditions(0.5, 1.0, 0.5)


def test_no_curriculum_gives_the_tasks_conditions() -> None:
    assert NoCurriculum().conditions(0, 0.0, FINAL) == FINAL


@pytest.mark.parametrize("wrong", [{"filter_time": -0.12}, {"gravity_scale": -1.0}, {"length": 0.0}])
def test_impossible_ramps_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError):
        LinearCurriculum(**wrong)
