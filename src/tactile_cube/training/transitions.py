"""From a collected block to transitions for the replay: executed actions, n-step sums, faulty episodes left out."""

import torch
from tensordict import TensorDict, TensorDictBase
from torchrl.data import MultiStep


class TransitionAssembler:
    """Turn blocks (worlds, time) into flat transitions, the last n - 1 steps waiting for their future.

    Sums are TorchRL's `MultiStep`. Its sibling for replay buffers, `MultiStepTransform`, would hold back one step more
    and could not give the waiting ones out before the worlds are reset, the only place where a run can be resumed.

    Args:
        n_step: rewards summed before bootstrapping; fewer where an episode or the stream ends first.
        gamma: discount inside the sum.
    """

    def __init__(self, n_step: int, gamma: float):
        self.sums = MultiStep(gamma, n_step)
        self.sums.reward_keys = ("reward_terms",)
        self.sums.done_keys = ()  # how the last step of a sum ended is how the sum ended
        self.pending: TensorDictBase | None = None

    def add(self, block: TensorDictBase) -> TensorDictBase:
        """Transitions (rows,) that the block completes."""
        stream = _fields(block)
        if self.pending is not None:
            stream = torch.cat((self.pending, stream), 1)
        ready = max(stream.shape[1] - (self.sums.n_steps - 1), 0)
        self.pending = stream[:, ready:]
        return self._sum(stream, ready)

    def flush(self) -> TensorDictBase:
        """The waiting steps, bootstrapped from the last state seen; call before the worlds are reset."""
        stream, self.pending = self.pending, None
        assert stream is not None, "add a block first"
        return self._sum(stream, stream.shape[1])

    def _sum(self, stream: TensorDictBase, count: int) -> TensorDictBase:
        """n-step transitions that start at the first `count` times of the stream."""
        if not count:
            return stream[:, :0].flatten()
        stream, faulty = stream.clone(), stream["next", "faulty"]
        # a faulty step may hold NaN: sums stop before it
        stream["next", "done"][:, :-1] |= faulty[:, 1:]
        stream["next", "reward_terms"].masked_fill_(faulty, 0.0)
        summed = self.sums(stream)[:, :count][~faulty[:, :count].squeeze(-1)]
        return summed.set("steps_to_next_obs", summed["steps_to_next_obs"].unsqueeze(-1))


def _fields(block: TensorDictBase) -> TensorDict:
    following = block["next"]
    fields = {
        "observation": block["observation"],
        "privileged": block["privileged"],
        # both are missing where no extra exploration is configured
        "action": following.get("action_taken", block["action"]),
        "demonstrated": following.get("demonstrated", torch.zeros_like(following["terminated"])),
        "next": following.select("observation", "privileged", "reward_terms", "terminated", "done", "faulty"),
    }
    return TensorDict(fields, block.batch_size)
