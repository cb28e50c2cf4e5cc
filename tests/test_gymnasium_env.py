import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium.utils.env_checker import check_env
from hydra import initialize
from hydra.core.global_hydra import GlobalHydra

from tactile_cube import gymnasium_env
from tactile_cube.env import Task
from tactile_cube.errors import InputError
from tactile_cube.evaluation.episode_record import EpisodeRecord
from tactile_cube.evaluation.policies import ScriptedPolicy
from tactile_cube.evaluation.rollout import run_episode
from tactile_cube.evaluation.verdict import judge_episode
from tactile_cube.gymnasium_env import GymnasiumRotation
from tactile_cube.randomization import Randomization
from tactile_cube.transforms import EnvConfig, make_env


@pytest.fixture
def env() -> Iterator[GymnasiumRotation]:
    noisy = Randomization(sensor_noise=0.002, sticky_probability=0.1)
    env = GymnasiumRotation(EnvConfig(Task("table", table=True, episode_steps=5), randomization=noisy))
    yield env
    env.close()


def test_checker_of_gymnasium_is_content() -> None:
    env = gymnasium.make("tactile_cube/Rotation-v0", render_mode="rgb_array", values={"task.episode_steps": 5})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize(
    ("imports", "name"),
    [
        ("import tactile_cube; import gymnasium", "tactile_cube/Rotation-v0"),
        ("import gymnasium", "tactile_cube.gymnasium_env:tactile_cube/Rotation-v0"),
    ],
)
def test_the_name_is_registered_whatever_the_order_of_imports(imports: str, name: str) -> None:
    code = f"{imports}; print(gymnasium.make({name!r}).spec.id)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert run.stdout.strip() == "tactile_cube/Rotation-v0", run.stderr


@pytest.mark.parametrize("action", [np.full(12, np.nan), np.zeros(11), np.zeros((1, 12))])
def test_an_action_that_is_none_is_refused(env: GymnasiumRotation, action: np.ndarray) -> None:
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"give \(12,\) finite numbers"):
        env.step(action)


def test_environments_without_a_seed_differ() -> None:
    noisy = EnvConfig(Task("table", table=True, episode_steps=5), randomization=Randomization(sensor_noise=0.002))
    first, other = (GymnasiumRotation(noisy).reset()[0] for _ in range(2))
    assert not np.array_equal(first, other)


def test_a_mistyped_option_is_refused_in_one_line_with_what_it_may_have_meant() -> None:
    with pytest.raises(InputError, match=r"^[^\n]*task/tabel[^\n]*; did you mean task=table\?$"):
        gymnasium.make("tactile_cube/Rotation-v0", task="tabel")


def test_a_picture_shows_the_cube_where_it_is(env: GymnasiumRotation) -> None:
    assert env.render() is None, "without a render mode"
    drawing = GymnasiumRotation(EnvConfig(Task("table", table=True, episode_steps=5)), render_mode="rgb_array")
    drawing.reset(seed=0)
    picture = drawing.render()
    assert (picture.shape, picture.dtype) == ((256, 512, 3), np.uint8)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50
    np.testing.assert_array_equal(drawing.render(), picture)
    drawing.step(np.ones(12, dtype=np.float32))
    moved = np.abs(drawing.render().astype(int) - picture).max(axis=2) > 30
    assert 20 < moved.sum() < 0.5 * moved.size
    drawing.close()


def test_another_render_mode_is_refused() -> None:
    with pytest.raises(InputError, match="render_mode is 'human'; choose 'rgb_array' or None"):
        GymnasiumRotation(EnvConfig(Task("full")), render_mode="human")


def test_success_is_that_of_evaluate_told_in_the_last_step(env, monkeypatch) -> None:
    judged = []

    def judge_episode(record: EpisodeRecord) -> SimpleNamespace:
        judged.append(record)
        return SimpleNamespace(success=True)

    monkeypatch.setattr(gymnasium_env, "judge_episode", judge_episode)
    env.reset(seed=0)
    infos = [env.step(np.zeros(12, dtype=np.float32))[-1] for _ in range(5)]
    assert [info.get("is_success") for info in infos] == [None] * 4 + [True]
    (record,) = judged
    assert record.steps == 5
    assert record.theta[-1] == infos[-1]["theta"]
    assert record.ending == infos[-1]["outcome"] == "time_limit"
    assert len(record.contacts.step) > 0


def test_the_scripted_gait_earns_the_success_that_evaluate_gives_it() -> None:
    config = EnvConfig(Task("table", table=True, episode_steps=100))
    env = GymnasiumRotation(config)
    observation, _ = env.reset(seed=0)
    policy, step, ended, info = ScriptedPolicy(), 0, False, {}
    policy.start(env._env.base_env.tasks[0], 0)
    while not ended:
        observation, _, terminated, truncated, info = env.step(policy.act(observation, step))
        step, ended = step + 1, terminated or truncated
    env.close()
    made = make_env(config, 1, 0, evaluation=True)
    expected = judge_episode(run_episode(made, ScriptedPolicy(), 0), 0, 0)
    made.close()
    assert info["theta"] == pytest.approx(expected.final_angle)
    assert info["is_success"] == expected.success


def test_registered_name_takes_options_of_the_configuration() -> None:
    env = gymnasium.make("tactile_cube/Rotation-v0", task="float", values={"task.filter_time": 0.25})
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
    assert {"spin", "leaving"} < info["reward_terms"].keys()
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


def example_of(page: str) -> dict[str, Any]:
    """What the first piece of Python of a page leaves behind."""
    example = (Path(__file__).parents[1] / page).read_text().split("```python\n")[1].split("```")[0]
    namespace: dict[str, Any] = {}
    exec(example, namespace)
    return namespace


def test_the_examples_for_stable_baselines_run() -> None:
    pytest.importorskip("stable_baselines3")
    assert example_of("README.md")["model"].num_timesteps == 200
    namespace = example_of("docs/gymnasium.md")
    assert namespace["picture"].shape == (256, 512, 3)
    assert namespace["info"]["is_success"] in (True, False)
