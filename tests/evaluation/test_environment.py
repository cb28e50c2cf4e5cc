import pytest

from tactile_cube.errors import InputError
from tactile_cube.evaluation.environment import _checked, _refuse_foreign_effects


def test_a_policy_file_cannot_name_foreign_classes() -> None:
    foreign = {"_target_": "tactile_cube.transforms.EnvConfig", "effects": [{"_target_": "os.system", "command": "x"}]}
    with pytest.raises(InputError, match=r"os\.system"):
        _checked(foreign, "stranger")


def test_own_classes_pass() -> None:
    own = {"_target_": "tactile_cube.transforms.EnvConfig", "task": {"_target_": "tactile_cube.env.Task"}}
    assert _checked(own, "own") == own


@pytest.mark.parametrize(
    "config",
    [{"model": {"effects": [{"effect": "my_rig.CableDrag@q2"}]}}, {"effects": ["my_rig.CableDrag@q2: stiffness=1"]}],
)
def test_a_policy_file_cannot_have_an_effect_of_its_owner_imported(config: dict) -> None:
    with pytest.raises(InputError, match=r"my_rig\.CableDrag"):
        _refuse_foreign_effects(config, "stranger")
    _refuse_foreign_effects({"model": None, "effects": ["backlash@q2: play=0.1"]}, "own")
