import dataclasses

import pytest

from tactile_cube.env import OUTCOMES, CubePose, Task
from tactile_cube.env.task import Conditions
from tactile_cube.errors import InputError
from tactile_cube.simulation import EpisodeConstants

START = CubePose(0.1, -0.2, 0.3, 0.5, 0.0, 0.0, 0.6)


@pytest.mark.parametrize(
    ("moved", "step", "expected"),
    [
        ({}, 99, "running"),
        ({}, 100, "time_limit"),
        ({"z": -0.039}, 5, "running"),
        ({"z": -0.041}, 5, "dropped"),
        ({"z": 0.039}, 5, "running"),
        ({"z": 0.041}, 5, "lifted"),
        ({"x": -0.036}, 5, "left_range"),
        ({"y": 0.036}, 5, "left_range"),
        ({"x": 0.034, "y": -0.034}, 5, "running"),
        ({"tilt": 0.19}, 5, "running"),
        ({"tilt": 0.21}, 5, "tilted"),
        ({"z": -0.041}, 100, "dropped"),
        ({"theta": 20.0}, 5, "running"),
    ],
)
def test_outcome_names_why_an_episode_ends(moved: dict[str, float], step: int, expected: str) -> None:
    now = START._replace(**{key: getattr(START, key) + way for key, way in moved.items()})
    assert OUTCOMES[Task("full").outcome(START, now, step)] == expected


def test_table_stands_under_the_cube_of_this_episode() -> None:
    constants = EpisodeConstants(cube_size=0.09)
    task = Task("table", table=True)
    assert task.apply(constants, task.conditions()).table_height == pytest.approx(-0.045)
    floating = dataclasses.replace(task, table=False)
    assert floating.apply(constants, floating.conditions()).table_height is None


def test_conditions_reach_the_constants() -> None:
    constants = Task("full").apply(
        EpisodeConstants(), Conditions(filter_time=0.2, gravity_scale=0.3, penalty_scale=1.0)
    )
    assert (constants.filter_time, constants.gravity_scale, constants.gravity_onset) == (0.2, 0.3, 4)


@pytest.mark.parametrize(
    "wrong", [{"filter_time": -0.1}, {"episode_steps": 0}, {"direction": 2}, {"gravity_scale": -1}]
)
def test_impossible_values_are_refused_with_key_and_value(wrong: dict[str, float]) -> None:
    ((key, value),) = wrong.items()
    with pytest.raises(InputError, match=rf"task\.{key} is {value}"):
        Task("full", **wrong)
