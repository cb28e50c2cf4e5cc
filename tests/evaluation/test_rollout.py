"""Whole episodes in the real world, short ones."""

import dataclasses
from collections.abc import Iterator
from typing import Literal

import numpy as np
import pytest
from torchrl.envs import TransformedEnv

from tactile_cube.env import Task
from tactile_cube.env.reward import TOUCH_FORCE
from tactile_cube.evaluation.evaluation import DisplacedStart, Evaluation
from tactile_cube.evaluation.policies import HoldPolicy, RandomPolicy, ReplayPolicy
from tactile_cube.evaluation.protocol import Protocol, Pull, Variant
from tactile_cube.evaluation.rollout import run_episode
from tactile_cube.evaluation.verdict import EpisodeVerdict, support
from tactile_cube.hand import DLR_HAND2, tip_positions
from tactile_cube.randomization import Randomization, Uniform
from tactile_cube.simulation import SimulationOptions
from tactile_cube.transforms import EnvConfig, make_env

CONFIG = EnvConfig(
    Task("full", episode_steps=15),
    randomization=Randomization(joint_offset=Uniform(-0.01, 0.01), sensor_noise=0.002, sticky_probability=0.1),
    simulation=SimulationOptions(trace=True),
)


@pytest.fixture(scope="module")
def env() -> Iterator[TransformedEnv]:
    made = make_env(CONFIG, 1, 0, evaluation=True)
    yield made
    made.close()


def test_equal_seeds_give_equal_episodes_and_others_do_not(env: TransformedEnv) -> None:
    first, other, again = (run_episode(env, RandomPolicy(), seed) for seed in (3, 4, 3))
    np.testing.assert_array_equal(first.joint_position, again.joint_position)
    np.testing.assert_array_equal(first.cube_quaternion, again.cube_quaternion)
    np.testing.assert_array_equal(first.target, again.target)
    assert not np.array_equal(first.target, other.target)


def test_the_record_is_complete(env: TransformedEnv) -> None:
    record = run_episode(env, HoldPolicy(), 0)
    assert record.steps == 15
    assert record.ending == "time_limit"
    assert len(record.trace["q"]) == 15 * 50
    np.testing.assert_allclose(np.diff(record.trace["time"]), 0.002, atol=1e-9)
    np.testing.assert_allclose(record.trace["q"][-1], record.joint_position[-1], atol=2e-3)
    np.testing.assert_allclose(sum(record.reward_terms.values()), record.reward, rtol=1e-4, atol=1e-4)
    assert set(record.contacts.finger.tolist()) == {0, 1, 2, 3}


def test_the_record_holds_what_the_policy_got_with_offset_and_noise(env: TransformedEnv) -> None:
    record = run_episode(env, RandomPolicy(), 0)
    error = record.policy["q_m"][1:] - record.trace["q_m"][49:-1:50]  # of the physics step before the policy was asked
    assert 0.0015 < np.std(error - error.mean(axis=0)) < 0.0025
    offset = np.abs(error.mean(axis=0))
    assert 0.002 < offset.max() < 0.012


def test_the_record_holds_what_the_policy_asked_for_before_it_was_repeated(env: TransformedEnv) -> None:
    record = run_episode(env, RandomPolicy(), 1)
    middle = 0.5 * (DLR_HAND2.action_lower + DLR_HAND2.action_upper)
    asked = middle + (DLR_HAND2.action_upper - middle) * record.policy["action"]
    differing = np.flatnonzero(np.abs(asked - record.target).max(axis=1) > 1e-4)
    assert len(differing) == 1
    np.testing.assert_allclose(record.target[differing[0]], record.target[differing[0] - 1], atol=1e-6)


def test_contact_forces_of_a_held_cube_carry_its_weight(env: TransformedEnv) -> None:
    held = make_env(dataclasses.replace(CONFIG, randomization=Randomization()), 1, 0, evaluation=True)
    record = run_episode(held, HoldPolicy(), 0)
    held.close()
    last = record.contacts.step == record.steps
    total = record.contacts.force[last].sum(axis=0)
    np.testing.assert_allclose(total[2], 0.05 * 9.81, atol=0.1)
    np.testing.assert_allclose(total[:2], 0.0, atol=0.15)


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
@pytest.mark.parametrize("by_tips", [True, False])
def test_what_bears_the_cube_is_told_in_both_engines(engine: Literal["bullet", "mujoco"], by_tips: bool) -> None:
    """Without weight: squeezed by the four tips, or pushed up by 2 N between open fingers, which links stop."""
    task = Task("full", episode_steps=15, gravity_scale=0.0, height_range=0.2)
    made = make_env(EnvConfig(task, simulation=SimulationOptions(engine)), 1, 0, evaluation=True)
    policy = HoldPolicy() if by_tips else ReplayPolicy(DLR_HAND2.start_angles[None])
    push = 0.0 if by_tips else 2.0
    record = run_episode(
        made, policy, 0, lambda env, step: env.world.push_cube(np.array([0.0, 0.0, push]), np.zeros(3))
    )
    made.close()
    borne, table = support(record), record.contacts
    links = float(not by_tips)
    assert (borne["tip_support"] >= 0.9, borne["link_contact"], borne["link_force_share"]) == (by_tips, links, links)
    assert table.force[table.step == record.steps].sum(axis=0) == pytest.approx([0.0, 0.0, -push], abs=0.03)
    centres = np.array([tip_positions(DLR_HAND2, q) for q in record.joint_position])[table.step, table.finger]
    far = np.linalg.norm(table.position - centres, axis=1)[table.normal_force > TOUCH_FORCE]
    assert far.max() < 0.015 if by_tips else far.min() > 0.03  # the sphere of a tip has a radius of 14.25 mm


def test_replaying_an_undisturbed_episode_repeats_it() -> None:
    undisturbed = dataclasses.replace(CONFIG.randomization, sticky_probability=0.0)
    quiet = make_env(dataclasses.replace(CONFIG, randomization=undisturbed), 1, 0, evaluation=True)
    original = run_episode(quiet, RandomPolicy(), 5)
    replayed = run_episode(quiet, ReplayPolicy(original.target), 5)
    displaced = run_episode(quiet, ReplayPolicy(original.target), 5, DisplacedStart(1, 0.0005))
    quiet.close()
    np.testing.assert_allclose(replayed.cube_position, original.cube_position, atol=1e-4)
    assert 1e-5 < np.abs(displaced.cube_position - original.cube_position).max() < 0.02


def test_a_pulled_finger_gives_way_and_is_let_go(env: TransformedEnv) -> None:
    pulled = run_episode(env, HoldPolicy(), 0, Pull("thumb", 2.0, start=0.5, duration=0.5))
    still = run_episode(env, HoldPolicy(), 0)
    moved = np.abs(pulled.joint_position - still.joint_position)
    assert moved[:6].max() == 0.0
    assert moved[8:11, 9:].max() > 0.05
    assert moved[8:11, :9].max() < moved[8:11, 9:].max()


def test_an_evaluation_judges_and_repeats_its_episodes() -> None:
    evaluation = Evaluation(CONFIG, HoldPolicy(), Protocol("x", episodes=2, seconds=1.0, replay=(0.0005,)), seed=1)
    seen: list[str] = []
    nominal, replay, policy = evaluation.run(lambda name, result: seen.append(name))
    assert [result.verdict for result in nominal.results] == [EpisodeVerdict.HOLDING] * 2
    assert [result.seed for result in nominal.results] == [10_000, 10_001]
    assert len(seen) == len(nominal.results) + len(replay.results) + len(policy.results) == 6
    assert {result.seed for result in (*replay.results, *policy.results)} <= {10_000, 10_001}, "in the best one's world"
    first, second = (result.final_angle for result in replay.results)
    assert first != second, "replays start displaced, each in its own way"
    record = evaluation.record(nominal.variant, nominal.results[1])
    assert record.theta[-1] == nominal.results[1].final_angle
    assert record.steps == 10
    assert nominal.unresolved == ""


def test_worlds_beyond_what_the_solver_resolves_are_named_where_they_are_met() -> None:
    slippery = Variant("slippery", constants={"tip_spinning_friction": 0.009})
    published = Variant("published", constants={"tip_spinning_friction": 0.1})
    protocol = Protocol("x", episodes=1, seconds=0.1, variants=(slippery, published))
    found = Evaluation(CONFIG, HoldPolicy(), protocol, seed=1).run(lambda name, result: None)
    assert ["0.1 m" in result.text for result in found] == [False, True]


def test_the_nominal_spinning_friction_of_a_map_is_the_environments() -> None:
    protocol = Protocol("x", nominal_values={"spinning friction [mm]": 100.0, "tip friction": 0.9})
    found = Evaluation(CONFIG, HoldPolicy(), protocol, seed=1).nominal_values
    assert found == {
        "spinning friction [mm]": pytest.approx(1e3 * CONFIG.constants.tip_spinning_friction),
        "tip friction": 0.9,
    }
