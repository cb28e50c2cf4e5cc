"""The command line, `tactile_cube.make_env` and Gymnasium open the same environment."""

from collections.abc import Callable
from typing import Any

import gymnasium
import pytest
import torch
from hydra.utils import instantiate
from tensordict import TensorDict
from torchrl.envs import TransformedEnv

import tactile_cube
from tactile_cube.api.job import as_word, called_job, settings_of
from tactile_cube.composition import composed
from tactile_cube.env import Conditions
from tactile_cube.evaluation.policies import environment, find_policy
from tactile_cube.training.build import as_environment
from tactile_cube.transforms import make_env

Door = Callable[..., TransformedEnv]


def trained(**settings: Any) -> TransformedEnv:
    """What `train` learns in, once its curriculum is over."""
    words = [as_word(key, value) for key, value in settings_of(settings).items()]
    env = as_environment(instantiate(composed("train", words).env)).make(worlds=1, seed=3)
    env.transform[0].set_progress(10**9, 100.0)
    return env


def gymnasiums(**settings: Any) -> TransformedEnv:
    env = gymnasium.make("tactile_cube/Rotation-v0", **settings).unwrapped._env  # type: ignore[attr-defined]
    env.set_seed(3)
    return env  # type: ignore[no-any-return]


def evaluated() -> TransformedEnv:
    """What `evaluate` tries a policy in that nobody trained."""
    job = called_job("evaluate", {"policy": "hold"})
    return make_env(environment(job.config, find_policy("hold"), job.choices), 1, 3, evaluation=True)


def ours(**settings: Any) -> TransformedEnv:
    return tactile_cube.make_env(tactile_cube.env_config(**settings), seed=3)


def told(env: TransformedEnv) -> dict[str, Any]:
    """What defines the environment."""
    task = env.base_env.tasks[0]
    parts = {part: getattr(task, part) for part in ("task", "reward", "randomization", "conditions")}
    return parts | {"nominal": repr(task.nominal), "start": repr(task.start_poses)}


@pytest.mark.parametrize("settings", [{}, {"task": "table"}, {"experiment": "table"}, {"experiment": "taught"}])
def test_all_doors_open_the_task_that_training_ends_at(settings: dict[str, str]) -> None:
    expected = told(trained(**settings))
    for door in (ours, gymnasiums, *([] if settings else [evaluated])):
        assert told(door(**settings)) == expected, door.__name__
    own = expected["task"]
    assert expected["conditions"] == Conditions(own.filter_time, own.gravity_scale, 1.0)


def test_the_default_is_the_full_weight_and_the_filter_of_the_task() -> None:
    assert told(ours())["conditions"] == Conditions(filter_time=0.5, gravity_scale=1.0, penalty_scale=1.0)
    easier = told(ours(values={"task.gravity_scale": 0.05, "task.filter_time": 0.12}))["conditions"]
    assert easier == Conditions(filter_time=0.12, gravity_scale=0.05, penalty_scale=1.0)


def test_all_doors_draw_the_same_and_leave_torchs_generator_alone() -> None:
    def episode(door: Door) -> list[torch.Tensor]:
        env = door()
        seen = [env.reset()["observation"]]
        for _ in range(4):
            moment = env.step(TensorDict({"action": torch.full((1, 12), 0.3)}, batch_size=[1]))["next"]
            seen += [moment["observation"], moment["privileged"], moment["reward"]]
        return seen

    expected = episode(trained)
    for door in (ours, gymnasiums, evaluated):
        torch.manual_seed(8)
        before = torch.get_rng_state()
        assert all(map(torch.equal, episode(door), expected)), door.__name__
        assert torch.equal(torch.get_rng_state(), before), door.__name__


def test_networks_built_after_an_environment_differ_from_seed_to_seed() -> None:
    drawn = []
    for seed in (0, 1):
        torch.manual_seed(seed)
        ours()
        drawn.append(torch.rand(3))
    assert not torch.equal(*drawn)
