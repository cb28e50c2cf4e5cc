from collections.abc import Callable
from typing import Any

import pytest
import torch
from torchrl.envs import TransformedEnv
from torchrl.envs.utils import step_mdp

from tactile_cube.errors import InputError
from tactile_cube.transforms import Exploration, FingerExploration

MakeEnv = Callable[..., TransformedEnv]


def run(env: TransformedEnv, worlds: int, steps: int) -> torch.Tensor:
    """Actions taken while the policy says 0, shape (steps, worlds, fingers, joints)."""
    data, taken = env.reset(), []
    for _ in range(steps):
        data = step_mdp(env.step(data.set("action", torch.zeros(worlds, 12))))
        taken.append(data["action_taken"].clone())
    return torch.stack(taken).unflatten(-1, (4, 3))


def test_only_the_given_part_of_the_episodes_explores(transformed: MakeEnv) -> None:
    env = transformed(FingerExploration(Exploration(episodes=0.3)), worlds=200)
    taken = run(env, 200, 20)
    exploring = env.transform._state["exploring"].flatten()
    assert float(exploring.float().mean()) == pytest.approx(0.3, abs=0.08)
    assert (taken[:, ~exploring] == 0.0).all()
    assert (taken[:, exploring] != 0.0).any()


def test_single_fingers_move_one_at_a_time(transformed: MakeEnv) -> None:
    env = transformed(FingerExploration(Exploration(episodes=1.0, probability=0.2, single=True)), worlds=40)
    moved = (run(env, 40, 40) != 0.0).all(-1)
    assert set(moved.sum(-1).unique().tolist()) == {0, 1}
    assert moved.any(dim=(0, 1)).all()


def test_one_two_or_all_fingers_hold_a_random_target_for_two_to_seven_steps(transformed: MakeEnv) -> None:
    env = transformed(FingerExploration(Exploration(episodes=1.0, probability=0.06)), worlds=60)
    taken, lengths, held = run(env, 60, 80).flatten(2), [], []
    for world in range(60):
        runs, count = torch.unique_consecutive(taken[:, world], dim=0, return_counts=True)
        holds = (runs != 0.0).any(-1)
        lengths += count[holds][:-1].tolist()
        held.append(runs[holds].unflatten(-1, (4, 3)))
    targets = torch.cat(held)
    moved = (targets != 0.0).all(-1)
    assert torch.equal(moved, (targets != 0.0).any(-1))
    shares = torch.bincount(moved.sum(-1), minlength=5) / len(moved)
    assert shares.tolist() == pytest.approx([0.0, 0.5, 0.25, 0.0, 0.25], abs=0.08)
    assert set(lengths) == {2, 3, 4, 5, 6, 7}
    angles = targets[moved]
    assert (angles.min(), angles.max()) == pytest.approx((-1.0, 1.0), abs=0.02)
    assert float(angles.mean()) == pytest.approx(0.0, abs=0.05)


def test_what_was_taken_reaches_the_world(transformed: MakeEnv) -> None:
    env = transformed(FingerExploration(Exploration(episodes=1.0, probability=1.0)), worlds=1)
    taken = run(env, 1, 3)[-1].flatten()
    task = env.base_env.tasks[0]
    wanted = task._middle + task._half_range * taken.double().numpy()
    assert task.world.commands[-1] == pytest.approx(wanted)


def test_a_gait_acts_in_demonstrations_and_the_policy_takes_over_for_some_steps(transformed: MakeEnv) -> None:
    gaits = (torch.arange(2.0)[:, None] / 2.0 + torch.arange(1.0, 31.0) / 100.0)[..., None].expand(2, 30, 12)
    explore = Exploration(episodes=0.0, probability=0.1, demonstrations=0.5, noise=0.0)
    env = transformed(FingerExploration(explore, gaits), worlds=100)
    taken = run(env, 100, 30)
    shows = env.transform._state["exploring"].flatten()
    assert float(shows.float().mean()) == pytest.approx(0.5, abs=0.15)
    assert (taken[:, ~shows] == 0.0).all()
    gait = taken[:, shows, 0, 0]
    assert torch.equal(taken[:, shows].amin((2, 3)), taken[:, shows].amax((2, 3)))
    clock = torch.arange(1.0, 31.0)[:, None] / 100.0
    followed = torch.isclose(gait, clock) | torch.isclose(gait, clock + 0.5)
    assert (followed | (gait == 0.0)).all()
    assert 0.05 < float((gait == 0.0).float().mean()) < 0.5


def test_demonstrated_steps_are_marked(transformed: MakeEnv) -> None:
    explore = Exploration(episodes=0.2, probability=0.2, demonstrations=0.4, noise=0.0)
    env = transformed(FingerExploration(explore, torch.full((1, 30, 12), 0.5)), worlds=100)
    data, marks, taken = env.reset(), [], []
    assert not data["demonstrated"].any()
    for _ in range(20):
        data = step_mdp(env.step(data.set("action", torch.zeros(100, 12))))
        marks.append(data["demonstrated"].flatten())
        taken.append((data["action_taken"] == 0.5).all(-1))
    assert torch.equal(torch.stack(marks), torch.stack(taken))
    assert 0.1 < float(torch.stack(marks).float().mean()) < 0.4


def test_noise_on_demonstrations_stays_in_the_action_range(transformed: MakeEnv) -> None:
    explore = Exploration(episodes=0.0, probability=0.0, demonstrations=1.0, noise=0.3)
    taken = run(transformed(FingerExploration(explore, torch.full((1, 9, 12), 0.9)), worlds=50), 50, 9)
    assert taken.max() == 1.0
    assert float(taken.mean()) == pytest.approx(0.83, abs=0.03)


def test_partial_reset_keeps_the_other_worlds_targets(transformed: MakeEnv) -> None:
    env = transformed(FingerExploration(Exploration(episodes=1.0, probability=1.0, shortest=7)), worlds=2)
    data = step_mdp(env.step(env.reset().set("action", torch.zeros(2, 12))))
    before = data["action_taken"].clone()
    data = env.reset(data.set("_reset", torch.tensor([[True], [False]])))
    after = env.step(data.set("action", torch.zeros(2, 12)))["next", "action_taken"]
    assert torch.equal(after[1], before[1])
    assert not torch.equal(after[0], before[0])


def test_a_gait_begins_anew_in_the_worlds_that_are_reset(transformed: MakeEnv) -> None:
    gait = (torch.arange(9.0) / 10.0)[None, :, None].expand(1, 9, 12)
    explore = Exploration(episodes=0.0, probability=0.0, demonstrations=1.0, noise=0.0)
    env = transformed(FingerExploration(explore, gait))
    data = env.reset()
    for _ in range(3):
        data = step_mdp(env.step(data.set("action", torch.zeros(2, 12))))
    data = env.reset(data.set("_reset", torch.tensor([[True], [False]])))
    assert data["demonstrated"].flatten().tolist() == [False, True]
    taken = env.step(data.set("action", torch.zeros(2, 12)))["next", "action_taken"]
    torch.testing.assert_close(taken, torch.tensor([[0.0], [0.3]]).expand(2, 12))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"episodes": 1.5}, r"exploration\.episodes is 1\.5"),
        ({"episodes": 0.6, "demonstrations": 0.5}, "more than all"),
        ({"shortest": 8}, "shortest"),
    ],
)
def test_impossible_settings_are_refused(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Exploration(**wrong)
