"""From a collected block to rows for the replay: executed actions, n-step sums, faulty episodes left out."""

import torch
from tensordict import TensorDictBase
from torch import Tensor


class TransitionAssembler:
    """Turn blocks (worlds, time) into flat transitions, the last n - 1 steps waiting for their future.

    Args:
        n_step: rewards summed before bootstrapping; fewer where an episode or the stream ends first.
        gamma: discount inside the sum.
    """

    def __init__(self, n_step: int, gamma: float):
        self.n_step = n_step
        self.gamma = gamma
        self.pending: dict[str, Tensor] | None = None

    def add(self, block: TensorDictBase) -> dict[str, Tensor]:
        """Transitions that the block completes, tensors (rows, width)."""
        stream = _fields(block)
        if self.pending is not None:
            stream = {key: torch.cat((self.pending[key], value), 1) for key, value in stream.items()}
        ready = max(stream["steps"].shape[1] - (self.n_step - 1), 0)
        self.pending = {key: value[:, ready:] for key, value in stream.items()} if self.n_step > 1 else None
        return self._sum(stream, ready)

    def flush(self) -> dict[str, Tensor]:
        """The waiting steps, bootstrapped from the last state seen; call before the worlds are reset."""
        stream, self.pending = self.pending, None
        return self._sum(stream, stream["steps"].shape[1]) if stream is not None else {}

    def _sum(self, stream: dict[str, Tensor], count: int) -> dict[str, Tensor]:
        """n-step transitions that start at the first `count` times of the stream."""
        result = {key: value[:, :count].clone() for key, value in stream.items()}
        length = stream["steps"].shape[1]
        going = ~result["done"]
        for ahead in range(1, self.n_step):
            reach = min(count, length - ahead)
            later = {key: value[:, ahead : ahead + reach] for key, value in stream.items()}
            # a faulty step may hold NaN: stop before it
            use = going[:, :reach] & ~later["faulty"]
            result["reward_terms"][:, :reach] += self.gamma**ahead * torch.where(use, later["reward_terms"], 0.0)
            for key in ("next_observation", "next_privileged", "terminated"):
                result[key][:, :reach] = torch.where(use, later[key], result[key][:, :reach])
            result["steps"][:, :reach] += use
            going[:, :reach] &= use & ~later["done"]
            going[:, reach:] = False
        kept = ~result["faulty"].squeeze(-1)
        return {key: value[kept] for key, value in result.items() if key not in ("done", "faulty")}


def _fields(block: TensorDictBase) -> dict[str, Tensor]:
    following = block["next"]
    taken = following.get("action_taken", None)
    return {
        "observation": block["observation"],
        "privileged": block["privileged"],
        "action": block["action"] if taken is None else taken,
        "reward_terms": following["reward_terms"],
        "next_observation": following["observation"],
        "next_privileged": following["privileged"],
        "terminated": following["terminated"].float(),
        "steps": torch.ones_like(following["terminated"], dtype=torch.float32),
        "demonstrated": _demonstrated(following),
        "done": following["done"],
        "faulty": following["faulty"],
    }


def _demonstrated(following: TensorDictBase) -> Tensor:
    flag = following.get("demonstrated", None)  # missing where no extra exploration is configured
    return torch.zeros_like(following["terminated"], dtype=torch.float32) if flag is None else flag.float()
