"""From collected blocks to transitions (executed actions, n-step sums, no faulty episodes) and episode statistics."""

from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor
from torchrl.data import MultiStep

from tactile_cube.randomization import Learnability

WINDOW = 50  # episodes, and blocks of steps, that the statistics go back
WINDOWS = ("angles", "lengths", "endings", "measured")


class EpisodeStatistics:
    """Final angles and lengths of the last episodes without extra exploration, and counts of how episodes ended.

    Args:
        outcomes: names of the outcome codes, e.g. ("running", "time", "dropped", ...); empty if the world has none.
        terms: names of the reward terms; what each adds to the reward of a step, over the last blocks, is logged.
        worlds: what becomes of the worlds that episodes draw.
    """

    def __init__(
        self, outcomes: Sequence[str] = (), terms: Sequence[str] = (), worlds: Learnability | None = None
    ) -> None:
        self.outcomes, self.terms = tuple(outcomes), tuple(terms)
        self.worlds = worlds or Learnability({}, 0.0)
        self.measured: deque[list[float]] = deque(maxlen=WINDOW)
        self.angles: deque[float] = deque(maxlen=WINDOW)
        self.lengths: deque[float] = deque(maxlen=WINDOW)
        self.endings: deque[int] = deque(maxlen=WINDOW)
        self.episodes = self.faulty = 0

    def add(self, block: TensorDictBase, weights: Tensor | float = 1.0) -> None:
        """Count the episodes that end in a block (worlds, steps); `weights` are those of the terms (terms,)."""
        following = block["next"]
        ended, faulty = (following[key].squeeze(-1) for key in ("done", "faulty"))
        if self.terms:
            weighted = following["reward_terms"].masked_fill(following["faulty"], 0.0) * weights
            self.measured.append(weighted.flatten(0, -2).mean(0).tolist())
        self.faulty += int((ended & faulty).sum())
        self.episodes += int(ended.sum())
        exploring = following.get("exploring", None)  # missing where no extra exploration is configured
        counted = ended & ~faulty if exploring is None else ended & ~faulty & ~exploring.squeeze(-1)
        # time first: the deque shall hold the last episodes in the order in which they ended
        last = following.transpose(0, 1)[counted.t()]
        self.angles.extend(last["theta"].flatten().tolist())
        self.lengths.extend(last["episode_step"].float().flatten().tolist())
        if self.worlds.ranges:
            self.worlds.add(last["places"].double().numpy(), last["terminated"].squeeze(-1).numpy())
        if self.outcomes:
            self.endings.extend(last["outcome"].flatten().tolist())

    @property
    def mean_angle(self) -> float:
        """Mean final angle [rad] of the last episodes; 0 before the first one ended."""
        return sum(self.angles) / len(self.angles) if self.angles else 0.0

    @property
    def kept(self) -> float:
        """Share of the last episodes that came to their time limit; 0 before the window of them is full."""
        full = len(self.endings) == WINDOW and "time_limit" in self.outcomes
        return self.endings.count(self.outcomes.index("time_limit")) / WINDOW if full else 0.0

    def summary(self) -> dict[str, float]:
        """Return the numbers for the log."""
        result = {
            "final_angle": self.mean_angle,
            "final_angle_best": max(self.angles, default=0.0),
            "episode_length": sum(self.lengths) / max(len(self.lengths), 1),
            "episodes": float(self.episodes),
            "faulty_episodes": float(self.faulty),
        }
        for code, name in enumerate(self.outcomes):
            if name not in ("running", "faulty"):
                result[f"ended_{name}"] = self.endings.count(code) / max(len(self.endings), 1)
        means = np.mean(self.measured, 0).tolist() if self.measured else [0.0] * len(self.terms)
        return result | {f"reward_{name}": value for name, value in zip(self.terms, means, strict=True)}

    def state_dict(self) -> dict[str, Any]:
        """Return the window and the counts."""
        windows = {name: list(getattr(self, name)) for name in WINDOWS}
        return {**windows, "episodes": self.episodes, "faulty": self.faulty, "lost": self.worlds.lost.tolist()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore what `state_dict` returned."""
        for name in WINDOWS:
            setattr(self, name, deque(state.get(name, ()), maxlen=WINDOW))
        self.episodes, self.faulty = state["episodes"], state["faulty"]
        self.worlds.lost = np.array(state.get("lost", [])).reshape(self.worlds.lost.shape)


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
        self.sums.done_keys = ()  # a sum ends as its last step does
        self.pending: TensorDictBase | None = None

    def add(self, block: TensorDictBase) -> TensorDictBase:
        """Return the transitions (rows,) that the block completes."""
        following = block["next"]
        fields = {
            "observation": block["observation"],
            "privileged": block["privileged"],
            # both are missing where no extra exploration is configured
            "action": following.get("action_taken", block["action"]),
            "demonstrated": following.get("demonstrated", torch.zeros_like(following["terminated"])),
            "next": following.select("observation", "privileged", "reward_terms", "terminated", "done", "faulty"),
        }
        stream: TensorDictBase = TensorDict(fields, block.batch_size)
        if self.pending is not None:
            stream = torch.cat((self.pending, stream), 1)
        ready = max(stream.shape[1] - (self.sums.n_steps - 1), 0)
        self.pending = stream[:, ready:]
        return self._sum(stream, ready)

    def flush(self) -> TensorDictBase:
        """Return the waiting steps, bootstrapped from the last state seen; call before the worlds are reset."""
        stream, self.pending = self.pending, None
        assert stream is not None, "add a block first"
        return self._sum(stream, stream.shape[1])

    def _sum(self, stream: TensorDictBase, count: int) -> TensorDictBase:
        """Return the n-step transitions that start at the first `count` times of the stream."""
        if not count:
            return stream[:, :0].flatten()
        stream, faulty = stream.clone(), stream["next", "faulty"]
        # a faulty step may hold NaN: sums stop before it
        stream["next", "done"][:, :-1] |= faulty[:, 1:]
        stream["next", "reward_terms"].masked_fill_(faulty, 0.0)
        summed = self.sums(stream)[:, :count][~faulty[:, :count].squeeze(-1)]
        return summed.set("steps_to_next_obs", summed["steps_to_next_obs"].unsqueeze(-1))
