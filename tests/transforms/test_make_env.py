import pickle
from typing import Any

import pytest
import torch
from torchrl.envs.utils import check_env_specs, step_mdp

from tactile_cube.env import Task
from tactile_cube.errors import InputError
from tactile_cube.randomization import Randomization, StartStates, Uniform
from tactile_cube.transforms import EnvConfig, Exploration, make_env

DISTURBED = Randomization(
    start_angles=Uniform(-0.03, 0.03),
    joint_offset=Uniform(-0.03, 0.03),
    sensor_noise=0.002,
    sticky_probability=0.1,
)


def config(**parts: Any) -> EnvConfig:
    task = Task("table", table=True, episode_steps=4)
    return EnvConfig(task, **{"randomization": DISTURBED, "exploration": Exploration()} | parts)


def test_environment_has_the_keys_and_sizes_of_the_paper() -> None:
    env = make_env(config(), worlds=2, seed=0)
    check_env_specs(env)
    data = env.rollout(6, break_when_any_done=False)
    assert data["observation"].shape == (2, 6, 120)
    assert data["privileged"].shape == (2, 6, 25)
    assert data["action"].shape == (2, 6, 12)
    assert data["next", "truncated"][:, 3].all()


def test_seed_determines_everything() -> None:
    env = make_env(config(), worlds=2, seed=3)
    first = env.rollout(6, break_when_any_done=False)
    second = make_env(config(), worlds=2, seed=3).rollout(6, break_when_any_done=False)
    env.set_seed(3)
    third = env.rollout(6, break_when_any_done=False)
    for key in ("observation", "privileged", "action", ("next", "reward")):
        assert torch.equal(first[key], second[key])
        assert torch.equal(first[key], third[key])
    env.set_seed(4)
    assert not torch.equal(first["observation"], env.rollout(6, break_when_any_done=False)["observation"])


def test_policy_cannot_see_the_object() -> None:
    """Whatever happens to the cube, what the policy sees at that moment does not change; what the critics see does."""
    env = make_env(config(exploration=Exploration(episodes=0.0)), worlds=1, seed=0)
    base, seen = env.base_env, []
    for displacement in (0.0, 0.02):
        env.set_seed(0)
        data = step_mdp(env.step(env.reset().set("action", torch.zeros(1, 12))))
        moments = list(base._moments)
        object_part = moments[0].object_state.copy()
        object_part[:13] += displacement
        moments[0].object_state = object_part
        raw = base._batch(with_reward=True)
        torch.manual_seed(1)
        seen.append(env.transform._step(data, raw))
    assert torch.equal(seen[0]["observation"], seen[1]["observation"])
    assert not torch.equal(seen[0]["privileged"], seen[1]["privileged"])


def test_evaluation_leaves_out_the_extra_exploration() -> None:
    keys = make_env(config(), worlds=1, seed=0, evaluation=True).rollout(1).keys(True)
    assert "exploring" not in keys
    assert ("next", "action_taken") not in keys


def test_configuration_can_be_sent_to_another_process() -> None:
    assert pickle.loads(pickle.dumps(config(start=StartStates(poses=3, yaw_range=0.5)))).start.poses == 3


def test_no_worlds_are_refused() -> None:
    with pytest.raises(InputError, match="number of worlds is 0"):
        make_env(config(), worlds=0, seed=0)
