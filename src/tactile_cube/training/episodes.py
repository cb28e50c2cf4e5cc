"""Statistics of finished episodes, read off the collected blocks."""

from collections import deque
from collections.abc import Sequence
from typing import Any

from tensordict import TensorDictBase

WINDOW = 50


class EpisodeStatistics:
    """Final angles and lengths of the last episodes without extra exploration, and counts of how episodes ended.

    Args:
        outcomes: names of the outcome codes, e.g. ("running", "time", "dropped", ...); empty if the world has none.
    """

    def __init__(self, outcomes: Sequence[str] = ()):
        self.outcomes = tuple(outcomes)
        self.angles: deque[float] = deque(maxlen=WINDOW)
        self.lengths: deque[float] = deque(maxlen=WINDOW)
        self.endings: deque[int] = deque(maxlen=WINDOW)
        self.episodes = 0
        self.faulty = 0

    def add(self, block: TensorDictBase) -> None:
        """Count the episodes that end in a block (worlds, steps)."""
        following = block["next"]
        ended = following["done"].squeeze(-1)
        faulty = following["faulty"].squeeze(-1)
        self.faulty += int((ended & faulty).sum())
        self.episodes += int(ended.sum())
        exploring = following.get("exploring", None)  # missing where no extra exploration is configured
        counted = ended & ~faulty
        if exploring is not None:
            counted &= ~exploring.squeeze(-1)
        # time first: the deque shall hold the last episodes in the order in which they ended
        last = following.transpose(0, 1)[counted.t()]
        self.angles.extend(last["theta"].flatten().tolist())
        self.lengths.extend(last["episode_step"].float().flatten().tolist())
        if self.outcomes:
            self.endings.extend(last["outcome"].flatten().tolist())

    @property
    def mean_angle(self) -> float:
        """Mean final angle [rad] of the last episodes; 0 before the first one ended."""
        return sum(self.angles) / len(self.angles) if self.angles else 0.0

    def summary(self) -> dict[str, float]:
        """Numbers for the log."""
        count = max(len(self.lengths), 1)
        result = {
            "final_angle": self.mean_angle,
            "final_angle_best": max(self.angles, default=0.0),
            "episode_length": sum(self.lengths) / count,
            "episodes": float(self.episodes),
            "faulty_episodes": float(self.faulty),
        }
        for code, name in enumerate(self.outcomes):
            if name not in ("running", "faulty"):
                result[f"ended_{name}"] = self.endings.count(code) / max(len(self.endings), 1)
        return result

    def state_dict(self) -> dict[str, Any]:
        """The window and the counts."""
        windows = {name: list(getattr(self, name)) for name in ("angles", "lengths", "endings")}
        return {**windows, "episodes": self.episodes, "faulty": self.faulty}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Inverse of `state_dict`."""
        for name in ("angles", "lengths", "endings"):
            setattr(self, name, deque(state[name], maxlen=WINDOW))
        self.episodes, self.faulty = state["episodes"], state["faulty"]
