"""Mistyped keys and options are answered with the nearest that there is."""

import pytest

from tactile_cube.command_help import CONFIG
from tactile_cube.did_you_mean import did_you_mean
from tactile_cube.sweep import sweep_folder


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        ("Could not override 'agent.gama'. Key 'gama' is not in struct", "agent.gamma"),
        ("Could not override 'gamma'. Key 'gamma' is not in struct", "agent.gamma"),
        ("Could not override 'trainig.steps'. Key 'trainig' is not in struct", "training.steps"),
        ("Could not override 'taks'. Key 'taks' is not in struct", "task"),
        ("In 'train': Could not find 'task/tabel' Available options", "task=table"),
        ("In 'train': Could not find 'experiment/curiculum' Available", "experiment=curriculum"),
        ("training.step: no such setting", "training.steps"),
    ],
)
def test_the_nearest_is_offered(message: str, expected: str) -> None:
    assert did_you_mean(message, CONFIG) == f"; did you mean {expected}?"


OF_ANOTHER_COMMAND = "Could not override 'rerun'."


@pytest.mark.parametrize(
    "message", ["Could not override 'xyzzy'.", "seed=-1: too small", "rows.csv: no such file", OF_ANOTHER_COMMAND]
)
def test_nothing_is_offered_where_nothing_is_near(message: str) -> None:
    assert did_you_mean(message, CONFIG) == ""


def test_folders_of_a_sweep_neither_begin_with_a_dash_nor_nest_nor_grow_too_long() -> None:
    assert sweep_folder("", 3) == "seed3"
    assert sweep_folder("task=table", 3) == "task=table-seed3"
    assert sweep_folder("training.init_from=a/b.pt", 3) == "training.init_from=a_b.pt-seed3"
    long = [sweep_folder("x" * 300 + end, 0) for end in "ab"]
    assert len(long[0]) < 255
    assert long[0] != long[1]
