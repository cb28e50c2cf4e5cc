from collections.abc import Callable

import torch
from torchrl.envs import TransformedEnv
from torchrl.envs.utils import step_mdp

from tactile_cube.transforms import ObservationStack

MakeEnv = Callable[..., TransformedEnv]


def reading(env: TransformedEnv, world: int) -> torch.Tensor:
    moment = env.base_env._moments[world]
    return torch.cat([torch.tensor(moment.joint_position), torch.tensor(moment.control_error)]).float()


def test_stack_is_filled_at_reset_and_then_holds_the_last_readings_oldest_first(transformed: MakeEnv) -> None:
    env = transformed(ObservationStack(5), worlds=1)
    data = env.reset()
    first = reading(env, 0)
    assert torch.equal(data["observation"][0], first.repeat(5))
    seen = [first] * 5
    for step in range(7):
        data = step_mdp(env.step(data.set("action", torch.full((1, 12), 0.1 * step))))
        seen.append(reading(env, 0))
        assert torch.equal(data["observation"][0], torch.cat(seen[-5:]))


def test_partial_reset_refills_only_the_worlds_that_start(transformed: MakeEnv) -> None:
    env = transformed(ObservationStack(5))
    before = step_mdp(env.step(env.reset().set("action", torch.ones(2, 12))))
    kept = before["observation"][1].clone()
    after = env.reset(before.set("_reset", torch.tensor([[True], [False]])))
    assert torch.equal(after["observation"][0], reading(env, 0).repeat(5))
    assert torch.equal(after["observation"][1], kept)
    going_on = env.step(after.set("action", torch.zeros(2, 12)))["next", "observation"][1]
    assert torch.equal(going_on[:-24], kept[24:])


def test_parts_are_gone(transformed: MakeEnv) -> None:
    data = transformed(ObservationStack(2)).rollout(2)
    assert "joint_position" not in data
    assert ("next", "control_error") not in data.keys(True)
