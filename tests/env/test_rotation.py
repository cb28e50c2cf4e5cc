from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tactile_cube.env import OUTCOMES, REWARD_TERMS, Reward, RotationEnv, Task
from tactile_cube.hand import DLR_HAND2
from tactile_cube.randomization import Randomization, Uniform

MakeTask = Callable[..., RotationEnv]


def test_actions_span_the_published_range_of_joint_angles(scripted_world: Any, rotation_task: MakeTask) -> None:
    world = scripted_world()
    env = rotation_task(world)
    env.reset()
    for action in (-1.0, 1.0):
        env.step(np.full(12, action))
    assert world.commands[0] == pytest.approx(DLR_HAND2.action_lower)
    assert world.commands[1] == pytest.approx(DLR_HAND2.action_upper)


@pytest.mark.parametrize("direction", [1, -1])
def test_theta_counts_turns_in_the_tasks_direction(
    direction: int, scripted_world: Any, rotation_task: MakeTask
) -> None:
    env = rotation_task(scripted_world(turn=0.08 * direction), task=Task("full", direction=direction))
    env.reset()
    for _ in range(100):
        moment = env.step(np.zeros(12))
    assert moment.theta == pytest.approx(8.0)
    assert moment.reward_terms[0] == pytest.approx(0.08)


@pytest.mark.parametrize(("symmetry", "period"), [(4, 0.5 * np.pi), (1, 2 * np.pi)])
def test_critics_see_the_yaw_up_to_the_symmetry(
    symmetry: int, period: float, scripted_world: Any, rotation_task: MakeTask
) -> None:
    env = rotation_task(scripted_world(turn=period / 20), task=Task("full", direction=1, symmetry=symmetry))
    first = env.reset().object_state[3:5].copy()
    seen = [env.step(np.zeros(12)).object_state[3:5].copy() for _ in range(20)]
    assert seen[-1] == pytest.approx(first, abs=1e-9)
    assert min(np.abs(one - first).max() for one in seen[:-1]) > 0.1


def test_reward_is_the_weighted_sum_of_the_terms(scripted_world: Any, rotation_task: MakeTask) -> None:
    env = rotation_task(scripted_world(turn=0.05, shift=(0.001, 0.0, 0.0)))
    env.reset()
    moment = env.step(np.zeros(12))
    assert moment.reward == pytest.approx(float(moment.reward_terms @ Reward().weights()))
    assert moment.reward_terms[2] == pytest.approx(0.001)


def test_fingers_that_stand_still_advance_around_a_cube_that_turns(
    scripted_world: Any, rotation_task: MakeTask
) -> None:
    env = rotation_task(scripted_world(turn=0.05), reward=Reward(advance=1.0))
    first = env.reset()
    still = DLR_HAND2.action_of(first.joint_position - 0.01)
    assert env.step(still).reward_terms[REWARD_TERMS.index("advance")] == pytest.approx(4 * 0.05, abs=0.01)


def test_time_limit_truncates_and_a_lost_cube_terminates(scripted_world: Any, rotation_task: MakeTask) -> None:
    env = rotation_task(task=Task("full", episode_steps=3))
    env.reset()
    last = [env.step(np.zeros(12)) for _ in range(3)][-1]
    assert (last.truncated, last.terminated) == (True, False)
    env = rotation_task(scripted_world(shift=(0.02, 0.0, 0.0)))
    env.reset()
    env.step(np.zeros(12))
    last = env.step(np.zeros(12))
    assert (last.truncated, last.terminated) == (False, True)
    assert last.reward_terms[REWARD_TERMS.index("leaving")] == 1.0


@pytest.mark.parametrize("damage", ["unhealthy", "not a number"])
def test_faulty_physics_ends_the_episode_with_finite_numbers(
    damage: str, scripted_world: Any, rotation_task: MakeTask
) -> None:
    world = scripted_world()
    env = rotation_task(world)
    before = env.reset()
    if damage == "unhealthy":
        world.healthy = False
    else:
        world.shift = np.array([np.nan, 0.0, 0.0])
    moment = env.step(np.zeros(12))
    assert OUTCOMES[moment.outcome] == "faulty"
    assert moment.truncated
    assert not moment.terminated
    assert moment.reward == 0.0
    assert np.array_equal(moment.object_state, before.object_state)


def test_episode_depends_on_seed_index_and_number_only(rotation_task: MakeTask) -> None:
    randomization = Randomization(start_angles=Uniform(-0.1, 0.1))

    def starts(seed: int, index: int, steps: int) -> list[list[float]]:
        env = rotation_task(randomization=randomization)
        env.seed(seed, index)
        result = []
        for _ in range(3):
            result.append(env.reset().joint_position.tolist())
            for _ in range(steps):
                env.step(np.zeros(12))
        return result

    reference = starts(1, 0, 0)
    assert reference == starts(1, 0, 7)
    assert reference[0] != reference[1]
    assert reference[0] != starts(1, 1, 0)[0]
    assert reference[0] != starts(2, 0, 0)[0]


def test_object_state_has_the_fourfold_angle_of_a_cube(scripted_world: Any, rotation_task: MakeTask) -> None:
    env = rotation_task(scripted_world(turn=np.pi / 2))
    first = env.reset()
    turned = env.step(np.zeros(12))
    assert turned.object_state[3:5] == pytest.approx(first.object_state[3:5])
    assert len(turned.object_state) == 25
