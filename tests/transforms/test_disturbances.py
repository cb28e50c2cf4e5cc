"""Joint offsets, sensor noise, sticky actions."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torchrl.envs import Compose, GymEnv, TransformedEnv
from torchrl.envs.utils import step_mdp

from tactile_cube.randomization import Constant, Uniform
from tactile_cube.transforms import JointOffset, SensorNoise, StickyAction

MakeEnv = Callable[..., TransformedEnv]
HALF = torch.full((12,), 0.5)


def test_offset_shifts_the_reading_and_the_commanded_angle_alike(transformed: MakeEnv) -> None:
    plain, shifted = transformed(JointOffset(Constant(0.0), HALF)), transformed(JointOffset(Constant(0.1), HALF))
    before, after = plain.reset(), shifted.reset()
    assert torch.allclose(after["joint_position"], before["joint_position"] + 0.1)
    assert torch.equal(after["control_error"], before["control_error"])
    action = torch.zeros(2, 12)
    plain.step(before.set("action", action))
    shifted.step(after.set("action", action))
    true = [env.base_env.tasks[0] for env in (plain, shifted)]
    scale = true[0]._half_range / 0.5
    assert true[1].world.commands[-1] == pytest.approx(true[0].world.commands[-1] - 0.1 * scale)
    assert np.array_equal(after["action"], action)


def test_offset_is_constant_in_an_episode_and_new_in_the_next(transformed: MakeEnv) -> None:
    env = transformed(JointOffset(Uniform(-0.1, 0.1), HALF))
    data = env.reset()
    first = env.transform.offset.clone()
    data = env.step(data.set("action", torch.zeros(2, 12)))
    assert torch.equal(env.transform.offset, first)
    env.reset(step_mdp(data).set("_reset", torch.tensor([[True], [False]])))
    assert torch.equal(env.transform.offset[1], first[1])
    assert (env.transform.offset[0] != first[0]).all()


def test_noise_has_the_given_size_and_opposite_signs(transformed: MakeEnv) -> None:
    def readings(std: float) -> tuple[torch.Tensor, torch.Tensor]:
        env = transformed(SensorNoise(std), worlds=200)
        data = env.reset()
        return data["joint_position"], data["control_error"]

    clean, noisy = readings(0.0), readings(0.02)
    noise = noisy[0] - clean[0]
    assert float(noise.std()) == pytest.approx(0.02, rel=0.05)
    assert torch.allclose(noisy[1] - clean[1], -noise, atol=1e-6)


def test_seed_determines_the_noise(transformed: MakeEnv) -> None:
    env = transformed(SensorNoise(0.02))
    runs = []
    for seed in (1, 1, 2):
        env.set_seed(seed)
        runs.append(env.reset()["joint_position"])
    assert torch.equal(runs[0], runs[1])
    assert not torch.equal(runs[0], runs[2])


def test_sticky_action_repeats_with_the_given_probability(transformed: MakeEnv) -> None:
    env = transformed(StickyAction(0.3), worlds=60)
    data = env.reset()
    repeated = []
    for step in range(50):
        data = step_mdp(env.step(data.set("action", torch.full((60, 12), 0.01 * step))))
        commands = [task.world.commands for task in env.base_env.tasks]
        repeated.append([len(c) > 1 and bool((c[-1] == c[-2]).all()) for c in commands])
    assert np.mean(repeated[1:]) == pytest.approx(0.3, abs=0.03)
    assert np.ptp(np.mean(repeated[1:], axis=1)) < 0.5, "each world by itself"


def test_first_step_of_an_episode_is_never_sticky(transformed: MakeEnv) -> None:
    env = transformed(StickyAction(0.999), worlds=2)
    data = step_mdp(env.step(env.reset().set("action", torch.full((2, 12), 0.5))))
    data = env.reset(data.set("_reset", torch.tensor([[True], [False]])))
    env.step(data.set("action", torch.full((2, 12), -0.5)))
    fresh, going_on = (task.world.commands for task in env.base_env.tasks)
    assert (fresh[-1] != fresh[-2]).all()
    assert (going_on[-1] == going_on[-2]).all()


def test_the_policys_action_stays_in_the_data(transformed: MakeEnv) -> None:
    env = transformed(StickyAction(0.9))
    data = env.reset()
    for step in range(5):
        action = torch.full((2, 12), 0.1 * step)
        data = env.step(data.set("action", action))
        assert torch.equal(data["action"], action)
        data = step_mdp(data)


def test_disturbances_work_on_any_environment_by_their_keys() -> None:
    plain = GymEnv("Pendulum-v1")
    offset = JointOffset(Constant(0.3), torch.ones(3), in_keys=["observation"], in_keys_inv=[])
    noise, sticky = SensorNoise(0.1, in_keys=["observation"], opposite=[]), StickyAction(1.0)
    disturbed = TransformedEnv(GymEnv("Pendulum-v1"), Compose(offset, noise, sticky))
    seen = []
    for env in (plain, disturbed):
        env.set_seed(0)
        torch.manual_seed(0)
        seen.append(env.reset()["observation"])
    shift = seen[1] - seen[0] - 0.3
    assert 0.0 < shift.abs().max() < 0.5
    assert offset.offset.tolist() == pytest.approx([0.3] * 3)
    assert disturbed.rollout(20)["next", "reward"].isfinite().all()
