"""The ring of transitions."""

import pytest
import torch
from tensordict import TensorDict

from tactile_cube.agent.networks import Sizes
from tactile_cube.errors import InputError
from tactile_cube.training.replay import FLAGS, Replay

SIZES = Sizes(observation=4, privileged=2, action=3)


def rows(replay: Replay, values: list[float]) -> TensorDict:
    column = torch.tensor(values).unsqueeze(-1)
    parts = {key: column.expand(-1, width).clone() for key, width in replay.widths.items()}
    return TensorDict({key: part.bool() if key in FLAGS else part for key, part in parts.items()}, [len(values)])


def test_block_larger_than_the_ring_leaves_its_end() -> None:
    replay = Replay(3, SIZES, 2, seed=0)
    replay.extend(rows(replay, [0.0]))
    replay.extend(rows(replay, [1.0, 2.0, 3.0, 4.0, 5.0]))
    assert sorted(replay.buffer[:]["observation"][:, 0].tolist()) == [3.0, 4.0, 5.0]


def test_rewards_are_weighted_when_sampled() -> None:
    replay = Replay(10, SIZES, 2, seed=0)
    transitions = rows(replay, [1.0, 1.0])
    transitions["next", "reward_terms"] = torch.tensor([[2.0, 5.0], [2.0, 5.0]])
    replay.extend(transitions)
    assert replay.sample(4, torch.tensor([1.0, 0.0]))["next", "reward"].flatten().tolist() == [2.0] * 4
    assert replay.sample(4, torch.tensor([0.0, -1.0]))["next", "reward"].flatten().tolist() == [-5.0] * 4


@pytest.mark.parametrize("count", [3, 12])
def test_restored_replay_samples_the_same(count: int) -> None:
    first, second = Replay(10, SIZES, 2, seed=0), Replay(10, SIZES, 2, seed=9)
    first.extend(rows(first, [float(i) for i in range(count)]))
    second.load_state_dict(first.state_dict())
    weights = torch.ones(2)
    assert torch.equal(first.sample(8, weights)["observation"], second.sample(8, weights)["observation"])
    for replay in (first, second):
        replay.extend(rows(replay, [99.0]))
    assert (first.buffer[:] == second.buffer[:]).all()


def test_replay_of_other_size_is_refused() -> None:
    full = Replay(10, SIZES, 2, seed=0)
    full.extend(rows(full, [0.0] * 10))
    with pytest.raises(InputError, match="replay in the checkpoint holds parts of the shapes"):
        Replay(5, SIZES, 2, seed=0).load_state_dict(full.state_dict())
