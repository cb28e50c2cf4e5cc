from typing import Any

import numpy as np
import pytest
import torch
from tensordict import TensorDict
from torchrl.envs import TransformedEnv
from torchrl.envs.transforms import Compose
from torchrl.envs.utils import check_env_specs, step_mdp

from tactile_cube.env import Task
from tactile_cube.errors import InputError
from tactile_cube.randomization import Randomization, Uniform
from tactile_cube.simulation import SimulationOptions
from tactile_cube.transforms import EnvConfig, Exploration, make_env
from tactile_cube.transforms.make_env import rotation_env, transforms

DISTURBED = Randomization(
    start_angles=Uniform(-0.03, 0.03), joint_offset=Uniform(-0.03, 0.03), sensor_noise=0.002, sticky_probability=0.1
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


def reading(env: TransformedEnv, world: int) -> torch.Tensor:
    moment = env.base_env._time_steps[world]
    return torch.cat([torch.tensor(moment.joint_position), torch.tensor(moment.control_error)]).float()


def test_observation_is_the_last_readings_oldest_first_and_a_reset_fills_it(transformed) -> None:
    env = transformed(Compose(*transforms(EnvConfig(Task("full"), stack=3), explore=False)))
    data = env.reset()
    assert "joint_position" not in data
    seen = [reading(env, 1)] * 3
    for step in range(5):
        data = step_mdp(env.step(data.set("action", torch.full((2, 12), 0.1 * step))))
        seen.append(reading(env, 1))
        assert torch.equal(data["observation"][1], torch.cat(seen[-3:]))
    kept = data["observation"][1].clone()
    after = env.reset(data.set("_reset", torch.tensor([[True], [False]])))
    assert torch.equal(after["observation"][0], reading(env, 0).repeat(3))
    assert torch.equal(after["observation"][1], kept)
    going_on = env.step(after.set("action", torch.zeros(2, 12)))["next", "observation"][1]
    assert torch.equal(going_on[:-24], kept[24:])


@pytest.mark.parametrize("visible", [True, False])
def test_critics_see_the_object_in_numbers_of_the_size_of_one_if_at_all(visible: bool) -> None:
    usual = [0.01] * 3 + [1.0] * 2 + [0.1] * 2 + [0.05] * 3 + [1.0] * 15  # [m], [1], [rad], [m/s], [rad/s], q_f [rad]
    data = TensorDict({"object_state": torch.tensor([usual] * 2)}, [2])
    for transform in transforms(EnvConfig(Task("full"), privileged=visible), explore=False)[4:6]:
        data = transform._call(data)
    torch.testing.assert_close(data["privileged"], torch.full((2, 25), float(visible)))
    assert "object_state" not in data


def test_policy_cannot_see_the_object() -> None:
    """Whatever happens to the cube, what the policy sees at that moment does not change; what the critics see does."""
    env = make_env(config(exploration=Exploration(episodes=0.0)), worlds=1, seed=0)
    base, seen = env.base_env, []
    for displacement in (0.0, 0.02):
        env.set_seed(0)
        data = step_mdp(env.step(env.reset().set("action", torch.zeros(1, 12))))
        moments = list(base._time_steps)
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


def test_no_worlds_are_refused() -> None:
    with pytest.raises(InputError, match="number of worlds is 0"):
        make_env(config(), worlds=0, seed=0)


def test_a_model_shapes_the_world_that_is_trained_in() -> None:
    effect = {"effect": "torque_bias@q2", "parameters": {"bias": {"value": -0.2, "low": -0.21, "high": -0.19}}}
    model = {"joints": ["q1", "q2", "q3"], "effects": [effect], "values": {"kp": {"q3": 3.0}}}
    config = EnvConfig(Task("full"), model=model)
    assert [(one.joint, one.values) for one in config.effects] == [
        (f"{finger}_q2", {"bias": -0.2}) for finger in ("ring", "middle", "fore", "thumb")
    ]
    assert config.constants.kp[2] == 3.0
    assert config.model is None  # done: replacing a part does not do it again
    env = rotation_env(config)
    env.reset()
    sizes = [effect.values["bias"] for effect in env.constants.effects]
    assert len(set(sizes)) == 4
    np.testing.assert_allclose(sizes, -0.2, atol=0.01)


def test_effects_are_named_as_text() -> None:
    config = EnvConfig(Task("full"), effects=["backlash@q3: play=0.05"])
    assert [one.values["play"] for one in config.effects] == [0.05] * 4


def test_mixed_engines_alternate_over_worlds_and_processes() -> None:
    for seed, expected in ((0, ["bullet", "mujoco", "bullet"]), (1, ["mujoco", "bullet", "mujoco"])):
        env = make_env(config(simulation=SimulationOptions("mixed")), worlds=3, seed=seed)
        assert [task.world.options.engine for task in env.base_env.tasks] == expected
        env.close()


def test_one_world_cannot_be_in_two_engines() -> None:
    with pytest.raises(InputError, match=r"simulation\.engine is 'mixed'"):
        rotation_env(config(simulation=SimulationOptions("mixed")))
