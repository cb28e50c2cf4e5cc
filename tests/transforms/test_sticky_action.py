from collections.abc import Callable

import numpy as np
import pytest
import torch
from torchrl.envs import TransformedEnv
from torchrl.envs.utils import step_mdp

from tactile_cube.transforms import StickyAction

MakeEnv = Callable[..., TransformedEnv]


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
