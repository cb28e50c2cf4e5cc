import warnings
from collections.abc import Iterator

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium.utils.env_checker import check_env
from hydra import initialize
from hydra.core.global_hydra import GlobalHydra

from tactile_cube.env import REWARD_TERMS, Task
from tactile_cube.randomization import Randomization
from tactile_cube.transforms import EnvConfig
from tactile_cube.transforms.gymnasium_env import GymnasiumRotation


@pytest.fixture
def env() -> Iterator[GymnasiumRotation]:
    noisy = Randomization(sensor_noise=0.002, sticky_probability=0.1)
    env = GymnasiumRotation(EnvConfig(Task("table", table=True, episode_steps=5), randomization=noisy))
    yield env
    env.close()


def test_checker_of_gymnasium_is_content(env: GymnasiumRotation) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)


def test_registered_name_makes_the_environment() -> None:
    import tactile_cube.registration

    tactile_cube.registration.register()
    env = gymnasium.make("tactile_cube/Rotation-v0", task="float", overrides=("task.filter_time=0.25",))
    observation, _ = env.reset(seed=0)
    assert observation.shape == (120,)
    task = env.unwrapped._env.base_env.tasks[0].task
    assert (task.name, task.filter_time) == ("float", 0.25)
    env.close()


def test_time_limit_is_truncation_and_the_info_is_named(env: GymnasiumRotation) -> None:
    env.reset(seed=0)
    for _ in range(5):
        *_, terminated, truncated, info = env.step(np.zeros(12, dtype=np.float32))
    assert (terminated, truncated, info["outcome"]) == (False, True, "time_limit")
    assert tuple(info["reward_terms"]) == REWARD_TERMS
    assert info["privileged"].shape == (25,)


def test_torchs_global_generator_is_neither_used_nor_changed(env: GymnasiumRotation) -> None:
    first, _ = env.reset(seed=1)
    torch.manual_seed(5)
    before = torch.get_rng_state()
    second, _ = env.reset(seed=1)
    assert np.array_equal(first, second)
    assert torch.equal(torch.get_rng_state(), before)


def test_can_be_made_inside_a_hydra_application() -> None:
    with initialize(version_base=None):
        gymnasium.make("tactile_cube/Rotation-v0").close()
        assert GlobalHydra.instance().is_initialized()
