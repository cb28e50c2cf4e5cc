import torch
from tensordict import TensorDict

from tactile_cube.transforms import transitions


def collected() -> TensorDict:
    """Two worlds, three steps; every entry tells its world and step."""
    number = torch.arange(6.0).reshape(2, 3, 1)
    after = {key: number.clone() for key in ("observation", "privileged", "reward", "reward_terms")}
    flags = {key: torch.zeros(2, 3, 1, dtype=torch.bool) for key in ("done", "terminated", "faulty")}
    extra = {"action_taken": number + 100, "theta": number}
    following = TensorDict({**after, **flags, **extra}, [2, 3])
    data = {"observation": number, "privileged": number, "action": number, "theta": number, "next": following}
    return TensorDict(data, [2, 3])


def test_rows_come_world_by_world_with_the_action_that_was_taken() -> None:
    rows = transitions(collected())
    assert rows["observation"].flatten().tolist() == list(range(6))
    assert rows["action"].flatten().tolist() == [100 + k for k in range(6)]
    assert "theta" not in rows


def test_without_exploration_the_policys_action_is_stored() -> None:
    data = collected()
    del data["next", "action_taken"]
    assert transitions(data)["action"].flatten().tolist() == list(range(6))


def test_faulty_transitions_never_reach_the_replay() -> None:
    data = collected()
    data["next", "faulty"][1, 0] = True
    assert transitions(data)["observation"].flatten().tolist() == [0, 1, 2, 4, 5]
