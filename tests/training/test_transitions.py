"""n-step sums, time limits, terminations and faults."""

import pytest
import torch
from tensordict import TensorDict, TensorDictBase

from tactile_cube.training.transitions import TransitionAssembler


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
