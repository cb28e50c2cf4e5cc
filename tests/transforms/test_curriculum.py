import pytest
from torchrl.envs import TransformedEnv

from tactile_cube.env import Conditions
from tactile_cube.env.worlds import WorldsEnv
from tactile_cube.errors import InputError
from tactile_cube.transforms import Curriculum, Ramps

FINAL = Conditions(filter_time=0.5, gravity_scale=1.0, penalty_scale=1.0)


def test_the_default_has_the_published_ramp() -> None:
    ramps = Ramps()
    for steps in (0, 2_000_000):
        assert ramps.conditions(steps, 9.0, FINAL) == Conditions(0.12, 0.05, 1.0)
    middle = ramps.conditions(4_000_000, 0.0, FINAL)
    assert (middle.filter_time, middle.gravity_scale) == pytest.approx((0.31, 0.525))
    for steps in (6_000_000, 9_000_000):
        assert ramps.conditions(steps, 0.0, FINAL) == FINAL


def test_conditions_follow_the_angle_up_and_down() -> None:
    ramps = Ramps(by="angle", low=1.0, high=3.0, penalty_scale=0.2)
    scales = [ramps.conditions(0, angle, FINAL).penalty_scale for angle in (0.0, 2.0, 5.0, 2.0)]
    assert scales == pytest.approx([0.2, 0.6, 1.0, 0.6])


def test_ramps_left_out_keep_the_tasks_values() -> None:
    ramps = Ramps(filter_time=None, gravity_scale=None, penalty_scale=0.5)
    assert ramps.conditions(0, 0.0, FINAL) == Conditions(0.5, 1.0, 0.5)
    assert Ramps(by=None).conditions(0, 0.0, FINAL) == FINAL


@pytest.mark.parametrize("wrong", [{"filter_time": -0.12}, {"gravity_scale": -1.0}, {"high": 0.0}, {"by": "time"}])
def test_impossible_ramps_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError):
        Ramps(**wrong)  # type: ignore[arg-type]


def test_the_transform_acts_from_the_first_reset_on_and_at_those_that_follow(rotation_task) -> None:
    env = TransformedEnv(WorldsEnv([rotation_task()]), Curriculum(Ramps(low=100, high=200)))
    env.reset()
    task = env.base_env.tasks[0]
    assert task.constants.filter_time == pytest.approx(0.12)
    shown = env.transform.set_progress(150, 0.0)
    assert shown.columns() == pytest.approx({"T_s": 0.31, "gravity": 0.525, "penalty": 1.0})
    assert task.constants.filter_time == pytest.approx(0.12)
    env.reset()
    assert task.constants.filter_time == pytest.approx(0.31)
