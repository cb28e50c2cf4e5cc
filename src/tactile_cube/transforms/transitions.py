"""From what a collector returns to the rows that a replay stores."""

from __future__ import annotations

from tensordict import TensorDict, TensorDictBase

NEXT_KEYS = ("observation", "privileged", "reward", "reward_terms", "done", "terminated")


def transitions(data: TensorDictBase) -> TensorDict:
    """Transitions to learn from, batch size [N], for collected data of any leading shape.

    The action is the one that the extra exploration left (key "action_taken"), where there is any. Transitions of
    faulty physics are left out.

    Returns:
        "observation", "privileged", "action" and under "next" the keys of NEXT_KEYS; rows in the order of the data.
    """
    after = data.get("next")
    taken = after.get("action_taken", None)
    rows = TensorDict(
        {
            "observation": data.get("observation"),
            "privileged": data.get("privileged"),
            "action": data.get("action") if taken is None else taken,
            "next": TensorDict({key: after.get(key) for key in NEXT_KEYS}, batch_size=data.batch_size),
        },
        batch_size=data.batch_size,
    ).reshape(-1)
    sound = ~after.get("faulty").reshape(-1)
    return rows if bool(sound.all()) else rows[sound]
