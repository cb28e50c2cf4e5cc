"""The ring of transitions."""

from typing import Any

import pytest
import torch
from torch.utils._python_dispatch import TorchDispatchMode

from tactile_cube.agent.batch import Sizes
from tactile_cube.errors import InputError
from tactile_cube.training.replay import Replay

SIZES = Sizes(observation=4, privileged=2, action=3)


def rows(replay: Replay, values: list[float]) -> dict[str, torch.Tensor]:
    return {name: torch.tensor(values).unsqueeze(-1).expand(-1, width).clone() for name, width in replay.widths.items()}


def test_oldest_transitions_are_overwritten() -> None:
    replay = Replay(5, SIZES, 2, seed=0)
    for start in (0.0, 3.0, 6.0):
        replay.extend(rows(replay, [start, start + 1, start + 2]))
    assert len(replay) == 5
    assert sorted(replay.rows[:, 0].tolist()) == [4.0, 5.0, 6.0, 7.0, 8.0]


def test_block_larger_than_the_ring_leaves_its_end() -> None:
    replay = Replay(3, SIZES, 2, seed=0)
    replay.extend(rows(replay, [0.0]))
    replay.extend(rows(replay, [1.0, 2.0, 3.0, 4.0, 5.0]))
    assert sorted(replay.rows[:, 0].tolist()) == [3.0, 4.0, 5.0]


def test_rewards_are_weighed_when_sampled() -> None:
    replay = Replay(10, SIZES, 2, seed=0)
    transitions = rows(replay, [1.0, 1.0])
    transitions["reward_terms"] = torch.tensor([[2.0, 5.0], [2.0, 5.0]])
    replay.extend(transitions)
    assert replay.sample(4, torch.tensor([1.0, 0.0])).reward.flatten().tolist() == [2.0] * 4
    assert replay.sample(4, torch.tensor([0.0, -1.0])).reward.flatten().tolist() == [-5.0] * 4


def test_parts_come_back_under_their_names() -> None:
    replay = Replay(10, SIZES, 1, seed=0)
    transitions = {name: torch.full((1, width), float(i)) for i, (name, width) in enumerate(replay.widths.items())}
    replay.extend(transitions)
    batch = replay.sample(2, torch.ones(1))
    for name in replay.widths:
        got = batch.reward if name == "reward_terms" else getattr(batch, name)
        assert got.unique().tolist() == [transitions[name][0, 0].item()]


@pytest.mark.parametrize("count", [3, 12])
def test_restored_replay_samples_the_same(count: int) -> None:
    first, second = Replay(10, SIZES, 2, seed=0), Replay(10, SIZES, 2, seed=9)
    first.extend(rows(first, [float(i) for i in range(count)]))
    second.load_state_dict(first.state_dict())
    weights = torch.ones(2)
    assert torch.equal(first.sample(8, weights).observation, second.sample(8, weights).observation)
    for replay in (first, second):
        replay.extend(rows(replay, [99.0]))
    assert torch.equal(first.rows, second.rows)


def test_replay_of_other_size_is_refused() -> None:
    full = Replay(10, SIZES, 2, seed=0)
    full.extend(rows(full, [0.0] * 10))
    with pytest.raises(InputError, match="replay in the checkpoint holds 10 rows"):
        Replay(5, SIZES, 2, seed=0).load_state_dict(full.state_dict())


class Largest(TorchDispatchMode):
    """Keeps the number of elements of the largest tensor that any operation makes, views aside."""

    elements = 0

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        result = func(*args, **(kwargs or {}))
        if isinstance(result, torch.Tensor) and not func.is_view:
            self.elements = max(self.elements, result.numel())
        return result


def test_a_sample_is_gathered_without_a_copy_of_the_ring() -> None:
    replay = Replay(50_000, Sizes(120, 25, 12), 6, seed=0)
    replay.written = 50_000
    with Largest() as largest:
        replay.sample(256, torch.ones(6))
    assert largest.elements == 256 * replay.rows.shape[1]
