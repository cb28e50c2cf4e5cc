from collections.abc import Callable

import numpy as np
import pytest
import torch
from torchrl.envs import TransformedEnv
from torchrl.envs.utils import step_mdp

from tactile_cube.randomization import Constant, Uniform
from tactile_cube.transforms import JointOffset

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
