"""Statistics of finished episodes."""

import pytest
import torch
from tensordict import TensorDict

from tactile_cube.randomization import Learnability, Uniform
from tactile_cube.training.transitions import WINDOW, EpisodeStatistics


def block(theta: list[list[float]], done: list[list[bool]], **flags: list[list[bool]]) -> TensorDict:
    """Blocks (worlds, steps)."""
    ends = torch.tensor(done).unsqueeze(-1)
    following = {
        "theta": torch.tensor(theta).unsqueeze(-1),
        "done": ends,
        "faulty": torch.zeros_like(ends),
        "episode_step": torch.full_like(ends, 7, dtype=torch.int64),
        "outcome": torch.ones_like(ends, dtype=torch.int64),
    }
    following |= {key: torch.tensor(value).unsqueeze(-1) for key, value in flags.items()}
    return TensorDict({"next": following}, batch_size=ends.shape[:2])


def test_only_final_angles_count() -> None:
    statistics = EpisodeStatistics()
    statistics.add(block([[1.0, 2.0, 3.0]], [[False, True, False]]))
    assert statistics.mean_angle == 2.0
    assert statistics.summary()["episode_length"] == 7.0


def test_exploring_and_faulty_episodes_are_left_out() -> None:
    statistics = EpisodeStatistics()
    both = [[True, True, True]]
    statistics.add(block([[1.0, 5.0, 9.0]], both, exploring=[[False, True, False]], faulty=[[False, False, True]]))
    assert list(statistics.angles) == [1.0]
    assert (statistics.episodes, statistics.faulty) == (3, 1)


def test_window_holds_the_last_episodes_in_order_of_time() -> None:
    statistics = EpisodeStatistics()
    statistics.add(block([[1.0, 3.0], [2.0, 4.0]], [[True, True], [True, True]]))
    assert list(statistics.angles) == [1.0, 2.0, 3.0, 4.0]
    statistics.add(block([[8.0] * WINDOW], [[True] * WINDOW]))
    assert statistics.mean_angle == 8.0


def test_endings_are_named() -> None:
    statistics = EpisodeStatistics(("running", "time_limit", "dropped"))
    statistics.add(block([[1.0, 1.0]], [[True, True]], outcome=[[1, 2]]))
    assert statistics.summary()["ended_dropped"] == 0.5


def test_kept_says_nothing_before_the_window_is_full() -> None:
    statistics = EpisodeStatistics(("running", "time_limit", "dropped"))
    statistics.add(block([[0.0] * (WINDOW - 1)], [[True] * (WINDOW - 1)]))
    assert statistics.kept == 0.0
    statistics.add(block([[0.0, 0.0]], [[True, True]], outcome=[[2, 2]]))
    assert statistics.kept == 1 - 2 / WINDOW


def test_what_reward_terms_add_is_logged_and_lost_worlds_counted() -> None:
    statistics = EpisodeStatistics((), ("spin", "tips"), Learnability({"cube_mass": Uniform(0.0, 1.0)}, 0.5))
    steps = block([[1.0, 1.0]], [[False, True]], terminated=[[False, True]])
    steps["next", "reward_terms"] = torch.tensor([[[9.0, 0.0], [7.0, 1.0]]])
    steps["next", "places"] = torch.full((1, 2, 1), 0.99)
    statistics.add(steps, torch.tensor([2.0, -0.5]))
    assert [statistics.summary()[f"reward_{name}"] for name in ("spin", "tips")] == [16.0, -0.25]
    assert statistics.worlds.lost[0] == pytest.approx([0.5] * 7 + [0.525])
    again = EpisodeStatistics((), ("spin", "tips"), Learnability({"cube_mass": Uniform(0.0, 1.0)}, 0.5))
    again.load_state_dict(statistics.state_dict())
    assert again.state_dict() == statistics.state_dict()


def test_statistics_come_back_from_a_checkpoint() -> None:
    first, second = EpisodeStatistics(), EpisodeStatistics()
    first.add(block([[1.0, 2.0]], [[True, True]]))
    second.load_state_dict(first.state_dict())
    assert first.summary() == second.summary()
    assert second.angles.maxlen == WINDOW
