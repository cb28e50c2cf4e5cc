from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tactile_cube.env import OUTCOMES, Reward, RotationEnv, Task
from tactile_cube.hand import DLR_HAND2, tip_positions
from tactile_cube.randomization import Constant, GraspStarts, Randomization, Uniform
from tactile_cube.simulation import SimulationOptions, World

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
def test_theta_counts_turns_in_the_tasks_direction(direction, scripted_world, rotation_task) -> None:
    begins_turned = Randomization(cube_rotation=(Constant(0.0), Constant(0.0), Constant(0.3)))
    task = Task("full", direction=direction)
    env = rotation_task(scripted_world(turn=0.08 * direction), task=task, randomization=begins_turned)
    env.reset()
    for _ in range(100):
        moment = env.step(np.zeros(12))
    assert moment.theta == pytest.approx(8.0)
    assert moment.reward_terms[0] == pytest.approx(0.08)


def test_a_cube_that_turns_faster_than_1_rad_a_second_earns_as_one_that_turns_so_fast(
    scripted_world: Any, rotation_task: MakeTask
) -> None:
    env = rotation_task(scripted_world(turn=0.3))
    env.reset()
    assert env.step(np.zeros(12)).reward_terms[0] == pytest.approx(0.1), "a step takes 0.1 s"


def test_a_moment_tells_the_state_of_its_world(scripted_world: Any, rotation_task: MakeTask) -> None:
    world = scripted_world(turn=0.3, shift=(0.001, -0.002, 0.003))
    env = rotation_task(world)
    env.reset()
    world.cube_linear_velocity, world.cube_angular_velocity = np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0])
    moment = env.step(np.linspace(-1.0, 1.0, 12))
    fourfold = [np.sin(1.2), np.cos(1.2), 0.0, 0.0]
    expected = [0.001, -0.002, 0.003, *fourfold, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, *world.q_f]
    np.testing.assert_allclose(moment.object_state, expected, atol=1e-12)
    np.testing.assert_array_equal(moment.joint_position, world.q_m)
    np.testing.assert_allclose(moment.control_error, world.q_f - world.q_m)


@pytest.mark.parametrize(("symmetry", "period"), [(4, 0.5 * np.pi), (1, 2 * np.pi)])
def test_critics_see_the_yaw_up_to_the_symmetry(symmetry, period, scripted_world, rotation_task) -> None:
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


@pytest.mark.parametrize("axis", ["x", "z", (1.0, -2.0, 0.5)])
def test_fingertips_go_ahead_about_the_tasks_axis(axis: Any, scripted_world: Any, rotation_task: MakeTask) -> None:
    world = scripted_world(turn=0.05, shift=(0.004, -0.003, 0.002))
    task = Task("full", direction=1, axis=axis)
    env = rotation_task(world, task=task, reward=Reward(advance=1.0))
    env.reset()

    def across() -> np.ndarray:
        seen = tip_positions(DLR_HAND2, world.q) - world.cube_position
        return np.asarray(seen - np.outer(seen @ task.axis_vector(), task.axis_vector()))

    before = across()
    terms = dict(zip(env.reward.terms, env.step(np.zeros(12)).reward_terms, strict=True))
    after = across()
    ways = np.arctan2(np.cross(before, after) @ task.axis_vector(), (before * after).sum(axis=1))
    assert np.abs(ways).min() > 1e-3
    assert terms["advance"] == pytest.approx(4 * terms["spin"] - ways.sum())


def test_a_fingertip_that_circles_the_axis_earns_nothing_by_it(scripted_world: Any, rotation_task: MakeTask) -> None:
    world = scripted_world(turn=0.0)
    env = rotation_task(world, reward=Reward(advance=1.0))
    env.reset()
    place = env.reward.terms.index("advance")
    earned = []
    for angle in [0.0] * 40 + list(np.linspace(0.0, -2.0 * np.pi, 17)):  # at first the joints come to rest
        round_it = tip_positions(DLR_HAND2, world.q)[0] + 0.005 * np.array([np.cos(angle), np.sin(angle), 0.0])
        world.shift = round_it - world.cube_position
        earned.append(env.step(np.zeros(12)).reward_terms[place])
    assert sum(earned[40:]) == pytest.approx(0.0, abs=1e-6)
    assert max(np.abs(earned[40:])) > 0.3


def test_the_time_limit_truncates(rotation_task: MakeTask) -> None:
    env = rotation_task(task=Task("full", episode_steps=3))
    env.reset()
    last = [env.step(np.zeros(12)) for _ in range(3)][-1]
    assert (last.truncated, last.terminated) == (True, False)


@pytest.mark.parametrize(
    ("outcome", "motion"),
    [
        ("dropped", {"shift": (0.0, 0.0, -0.05)}),
        ("left_range", {"shift": (0.04, 0.0, 0.0)}),
        ("lifted", {"shift": (0.0, 0.0, 0.05)}),
        ("tilted", {"turn": 0.9}),
    ],
)
def test_a_lost_cube_terminates_and_costs(outcome, motion, scripted_world, rotation_task) -> None:
    env = rotation_task(scripted_world(**motion), task=Task("full", axis="x" if outcome == "tilted" else "z"))
    env.reset()
    last = env.step(np.zeros(12))
    assert OUTCOMES[last.outcome] == outcome
    assert (last.truncated, last.terminated) == (False, True)
    assert last.reward_terms[env.reward.terms.index("leaving")] == 1.0


@pytest.mark.parametrize("damage", ["unhealthy", "not a number"])
def test_faulty_physics_ends_the_episode_with_finite_numbers(damage, scripted_world, rotation_task) -> None:
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


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_a_grasp_is_held_by_tips_alone(engine: Any) -> None:
    world = World(DLR_HAND2, SimulationOptions(engine=engine))
    start = GraspStarts().of(DLR_HAND2)
    env = RotationEnv(world, Task("full"), Reward(tips=1.0, links=1.0, link_force=1.0), Randomization(), start)
    env.reset()
    grasp = (world.q_f - env._middle) / env._half_range
    held = dict(zip(env.reward.terms, env.step(grasp).reward_terms.tolist(), strict=True))
    assert (held["tips"], held["links"], held["link_force"]) == (1.0, 0.0, 0.0)
    world.close()
