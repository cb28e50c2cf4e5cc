from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from torchrl.envs.utils import check_env_specs, step_mdp

from tactile_cube.env import OUTCOMES, RotationEnv
from tactile_cube.env.worlds import WorldsEnv
from tactile_cube.randomization import Randomization, Uniform

MakeTask = Callable[..., RotationEnv]
VARIED = Randomization(start_angles=Uniform(-0.1, 0.1))


def test_partial_reset_leaves_the_other_worlds_alone(rotation_task: MakeTask) -> None:
    env = WorldsEnv([rotation_task() for _ in range(3)])
    data = env.step(env.reset().set("action", torch.zeros(3, 12)))
    mask = torch.tensor([[False], [True], [False]])
    after = env.reset(step_mdp(data).set("_reset", mask))
    assert after["episode_step"].flatten().tolist() == [1, 0, 1]


def test_worlds_end_independently(scripted_world: Any, rotation_task: MakeTask) -> None:
    env = WorldsEnv([rotation_task(scripted_world(shift=(0.02, 0, 0))), rotation_task()])
    data = env.rollout(4, break_when_any_done=False)
    assert data["next", "terminated"][0].flatten().tolist() == [False, True, False, True]
    assert not data["next", "done"][1].any()
    assert OUTCOMES[int(data["next", "outcome"][0, 1])] == "left_range"


def test_what_a_world_draws_does_not_depend_on_its_neighbours(rotation_task: MakeTask) -> None:
    few = WorldsEnv([rotation_task(randomization=VARIED) for _ in range(2)])
    many = WorldsEnv([rotation_task(randomization=VARIED) for _ in range(5)])
    for env in (few, many):
        env.set_seed(4)
    first, second = few.reset()["joint_position"], many.reset()["joint_position"]
    assert torch.equal(first, second[:2])
    assert not torch.equal(first[0], first[1])


def test_faulty_world_is_marked_and_truncated(scripted_world: Any, rotation_task: MakeTask) -> None:
    broken = scripted_world()
    env = WorldsEnv([rotation_task(broken), rotation_task()])
    data = env.reset()
    broken.healthy = False
    after = env.step(data.set("action", torch.zeros(2, 12)))["next"]
    assert after["faulty"].flatten().tolist() == [True, False]
    assert after["truncated"].flatten().tolist() == [True, False]


def test_steered_constants_are_drawn_by_the_odds_and_told(rotation_task: MakeTask) -> None:
    steered = Randomization(values={"cube_mass": Uniform(0.0, 0.8)}, steered=0.5)
    env = WorldsEnv([rotation_task(randomization=steered) for _ in range(3)])
    check_env_specs(env)
    fifth = np.eye(8)[[4]]
    env.odds = fifth
    places = env.reset()["places"].flatten().tolist()
    masses = [task.constants.cube_mass for task in env.tasks]
    assert all(0.4 <= mass < 0.5 for mass in masses)
    assert masses == pytest.approx([0.8 * place for place in places])
    assert "places" not in WorldsEnv([rotation_task(randomization=VARIED)]).reset()
