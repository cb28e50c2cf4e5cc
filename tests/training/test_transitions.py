"""n-step sums, time limits, terminations and faults."""

import pytest
import torch
from tensordict import TensorDict, TensorDictBase

from tactile_cube.randomization import Learnability, Uniform
from tactile_cube.training.transitions import WINDOW, EpisodeStatistics, TransitionAssembler


def stream(length: int, done: dict[int, str] | None = None, faulty: int | None = None, start: int = 0) -> TensorDict:
    """One world whose state at time t is t and whose reward for the step from t is t + 1."""
    t = torch.arange(start, start + length, dtype=torch.float32).view(1, length, 1)
    ends = torch.zeros(1, length, 1, dtype=torch.bool)
    terminated, broken = ends.clone(), ends.clone()
    for time, kind in (done or {}).items():
        ends[0, time - start] = True
        terminated[0, time - start] = kind == "terminated"
    if faulty is not None:
        broken[0, faulty - start] = ends[0, faulty - start] = True
    terms = torch.where(broken, torch.nan, t + 1.0)
    following = {
        "observation": torch.where(broken, torch.nan, t + 1.0),
        "privileged": t + 1.0,
        "reward_terms": terms,
        "terminated": terminated | broken,
        "done": ends,
        "faulty": broken,
    }
    return TensorDict({"observation": t, "privileged": t, "action": t, "next": following}, batch_size=[1, length])


def table(transitions: TensorDictBase) -> list[tuple[float, float, float, float, float]]:
    """Rows (state, return, next state, terminated, steps)."""
    following = transitions["next"]
    parts = [transitions["observation"], following["reward_terms"], following["observation"], following["terminated"]]
    columns = torch.cat([part.float() for part in (*parts, transitions["steps_to_next_obs"])], -1)
    return [tuple(row) for row in columns.tolist()]


def test_one_step_transitions_are_the_block_itself() -> None:
    assembler = TransitionAssembler(1, 0.5)
    got = table(assembler.add(stream(3, {1: "truncated"})))
    assert got == [(0, 1, 1, 0, 1), (1, 2, 2, 0, 1), (2, 3, 3, 0, 1)]
    assert len(assembler.flush()) == 0


def test_three_steps_are_summed_with_discount_across_blocks() -> None:
    assembler = TransitionAssembler(3, 0.5)
    first = table(assembler.add(stream(3)))
    second = table(assembler.add(stream(3, start=3)))
    assert first == [(0, 1 + 1 + 0.75, 3, 0, 3)]
    assert second[0] == (1, 2 + 1.5 + 1, 4, 0, 3)
    assert [row[0] for row in second] == [1, 2, 3]
    rest = table(assembler.flush())
    assert rest == [(4, 5 + 3, 6, 0, 2), (5, 6, 6, 0, 1)]


@pytest.mark.parametrize(("kind", "flag"), [("terminated", 1.0), ("truncated", 0.0)])
def test_sum_ends_with_the_episode(kind: str, flag: float) -> None:
    got = table(TransitionAssembler(3, 0.5).add(stream(6, {1: kind})))
    assert got[0] == (0, 1 + 1, 2, flag, 2)
    assert got[1] == (1, 2, 2, flag, 1)
    assert got[2] == (2, 3 + 2 + 1.25, 5, 0, 3)


def test_faulty_step_is_left_out_and_not_reached_into() -> None:
    got = table(TransitionAssembler(3, 0.5).add(stream(6, faulty=2)))
    assert got == [(0, 1 + 1, 2, 0, 2), (1, 2, 2, 0, 1), (3, 4 + 2.5 + 1.5, 6, 0, 3)]


def test_action_that_was_taken_is_stored_where_exploration_overrode_it() -> None:
    block = stream(2)
    block["next", "action_taken"] = torch.full((1, 2, 1), 9.0)
    assert TransitionAssembler(1, 0.9).add(block)["action"].flatten().tolist() == [9.0, 9.0]


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
