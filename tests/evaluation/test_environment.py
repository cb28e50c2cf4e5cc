import pytest

from tactile_cube.errors import InputError
from tactile_cube.evaluation.environment import _checked


def test_a_policy_file_cannot_name_foreign_classes() -> None:
    foreign = {"_target_": "tactile_cube.transforms.EnvConfig", "effects": [{"_target_": "os.system", "command": "x"}]}
    with pytest.raises(InputError, match=r"os\.system"):
        _checked(foreign, "stranger")


def test_own_classes_pass() -> None:
    own = {"_target_": "tactile_cube.transforms.EnvConfig", "task": {"_target_": "tactile_cube.env.Task"}}
    assert _checked(own, "own") == own
