"""Every option of the configuration groups that define the environment makes an environment that runs."""

import pickle
from pathlib import Path

import pytest
from hydra.errors import InstantiationException
from hydra.utils import instantiate

from tactile_cube.composition import CONFIG, composed
from tactile_cube.env import Reward, Task
from tactile_cube.errors import InputError
from tactile_cube.randomization import StartStates
from tactile_cube.transforms import EnvConfig, Ramps, make_env
from tests.meshes import CUBE, write_obj

GROUPS = {
    "task": "table",
    "reward": "paper",
    "randomization": "paper",
    "start": "paper",
    "exploration": "none",
    "curriculum": "none",
}
OPTIONS = [(group, file.stem) for group in GROUPS for file in sorted((CONFIG / group).glob("*.yaml"))]


def configured(*settings: str, **options: str) -> EnvConfig:
    groups = GROUPS | options
    words = ["+env=rotation", "+model=null", *(f"+{group}={name}" for group, name in groups.items()), *settings]
    config = composed(None, words)
    return instantiate(config.env)


def test_critics_may_be_blind() -> None:
    data = make_env(configured("env.privileged=false"), worlds=1, seed=0).rollout(2)
    assert not data["privileged"].any()
    assert data["next", "observation"].any()


@pytest.mark.parametrize(("group", "option"), OPTIONS, ids=lambda name: name)
def test_option_makes_an_environment_that_runs(group: str, option: str) -> None:
    task = {"task": "full"} if option == "grasps" else {}  # they hold the cube in the air
    config = pickle.loads(pickle.dumps(configured(**task, **{group: option})))
    env = make_env(config, worlds=1, seed=0)
    data = env.rollout(2)
    assert not data["next", "faulty"].any()
    assert set(env.transform[0].set_progress(3_000_000, 2.5).columns()) == {"T_s", "gravity", "penalty"}
    env.close()


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_a_mesh_whose_size_is_drawn_makes_an_environment_that_runs(engine: str, tmp_path: Path) -> None:
    file = write_obj(tmp_path, 80.0 * CUBE)
    words = ["+object=mesh", f"object.file={file}", "object.scale=0.001", f"env.simulation.engine={engine}"]
    env = make_env(pickle.loads(pickle.dumps(configured(*words))), worlds=1, seed=0)
    sizes = []
    for _ in range(2):
        data = env.rollout(2)
        assert not data["next", "faulty"].any()
        sizes.append(env.base_env.tasks[0].constants.cube_size[0])
    assert sizes[0] != sizes[1]
    env.close()


def test_grasps_are_refused_where_the_object_lies_on_a_table() -> None:
    with pytest.raises(InputError, match="start=grasps holds the object in the air, the task has a table"):
        make_env(configured(start="grasps"), worlds=1, seed=0).rollout(1)


def test_published_options_equal_the_published_defaults_of_the_code() -> None:
    config = configured(task="full", curriculum="linear")
    assert config.task == Task("full")
    assert config.reward == Reward()
    assert config.start == StartStates()
    assert config.curriculum == Ramps()


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("task.filter_time=-0.1", r"task\.filter_time is -0\.1"),
        ("randomization.sticky_probability=2", r"randomization\.sticky_probability is 2"),
        ("+randomization.factors.kpp={_target_: tactile_cube.randomization.Constant, value: 1}", "no such constant"),
        ("env.stack=0", r"env\.stack is 0"),
    ],
)
def test_impossible_setting_is_refused_with_its_name(setting: str, message: str) -> None:
    with pytest.raises(InstantiationException, match=message) as caught:
        configured(setting)
    assert isinstance(caught.value.__cause__, InputError)
