"""Extra exploration that lifts fingers: noise on single joints hardly ever lets go of the cube and grasps it anew."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.data import Categorical, Composite, Unbounded
from torchrl.envs.transforms import Transform

from tactile_cube.errors import InputError
from tactile_cube.transforms.partial_reset import reset_mask

GROUPS = torch.tensor(
    [
        *[[finger == one for finger in range(4)] for one in range(4)],
        [True, False, True, False],
        [False, True, False, True],
        *[[True] * 4] * 2,
    ]
)
"""Fingers that move together (8, 4): each alone, the opposing pairs ring-fore and middle-thumb, all (twice)."""
HOLDS = -1  # in place of a walk's index: a random target is held


@dataclass(frozen=True)
class Exploration:
    """Extra exploration in a part of the episodes.

    Attributes:
        episodes: part of the episodes that explore.
        probability: with which a step of such an episode begins to hold a random target.
        shortest: fewest steps that a target is held.
        longest: most steps that it is held.
        gait: part of the targets that are a stretch of a hand-crafted gait with all fingers instead of a held
            random one.
        gait_longest: most steps of such a stretch.
    """

    episodes: float = 0.3
    probability: float = 0.06
    shortest: int = 2
    longest: int = 7
    gait: float = 0.0
    gait_longest: int = 40

    def __post_init__(self) -> None:
        """Refuses values without a meaning."""
        for key in ("episodes", "probability", "gait"):
            if not 0.0 <= getattr(self, key) <= 1.0:
                raise InputError(f"exploration.{key} is {getattr(self, key)}; give a number in [0, 1]")
        if not 1 <= self.shortest <= self.longest:
            raise InputError(
                f"exploration holds {self.shortest} to {self.longest} steps; give 1 <= shortest <= longest"
            )
        if not self.shortest <= self.gait_longest:
            raise InputError(
                f"exploration.gait_longest is {self.gait_longest}; give at least exploration.shortest={self.shortest}"
            )


class FingerExploration(Transform):  # type: ignore[misc]
    """In some episodes a group of fingers holds a random target for a few steps instead of what the policy says.

    Adds "exploring" (1), constant in an episode, so that statistics can leave such episodes out, and "action_taken"
    (12), the action after this transform: the one that a replay must store. Draws from torch's global generator, the
    same number of draws at every step.

    Example:
        >>> env = TransformedEnv(worlds, FingerExploration(Exploration(episodes=0.3)))
    """

    def __init__(self, exploration: Exploration, walks: Tensor | None = None) -> None:
        """Explores as `exploration` says; `walks` (walks, steps, 12) are actions of gaits, needed if gait > 0.

        Raises:
            InputError: the walks are shorter than a stretch of the gait may be.
        """
        super().__init__(out_keys=["exploring", "action_taken"])
        self.settings = exploration
        self._walks = torch.zeros(1, exploration.gait_longest, 12) if walks is None else walks
        if self._walks.shape[1] < exploration.gait_longest:
            raise InputError(
                f"exploration.gait_longest is {exploration.gait_longest}; the gaits last {self._walks.shape[1]} steps"
            )
        self._exploring = self._held = torch.zeros(0)
        self._walk = self._clock = self._target = self._fingers = self._taken = torch.zeros(0)

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        mask = reset_mask(tensordict, tensordict_reset)
        worlds = mask.shape[:-1]
        if self._exploring.shape != mask.shape:
            self._exploring = torch.zeros_like(mask)
            self._held = torch.zeros_like(mask, dtype=torch.int64)
            self._walk = torch.full(worlds, HOLDS)
            self._clock = torch.zeros(worlds, dtype=torch.int64)
            self._target = torch.zeros(*worlds, 12)
            self._fingers = torch.zeros(*worlds, 12, dtype=torch.bool)
            self._taken = torch.zeros(*worlds, 12)
        self._exploring = torch.where(mask, torch.rand(mask.shape) < self.settings.episodes, self._exploring)
        self._held = self._held.masked_fill(mask, 0)
        self._taken = self._taken.masked_fill(mask, 0.0)
        return self._call(tensordict_reset)

    def _inv_call(self, tensordict: TensorDictBase) -> TensorDictBase:
        action = tensordict.get("action")
        self._begin(action.shape[:-1])
        played = self._walks[self._walk.clamp_min(0), self._clock]
        target = torch.where((self._walk == HOLDS).unsqueeze(-1), self._target, played)
        self._taken = torch.where(self._fingers & (self._held > 0), target, action)
        self._clock = (self._clock + 1).clamp_max(self._walks.shape[1] - 1)
        self._held = (self._held - 1).clamp_min(0)
        return tensordict.set("action", self._taken)

    def _begin(self, worlds: torch.Size) -> None:
        """Lets exploring worlds that hold nothing begin to hold, with the probability of a step."""
        begins = (torch.rand(*worlds, 1) < self.settings.probability) & self._exploring & (self._held == 0)
        steps = torch.randint(self.settings.shortest, self.settings.longest + 1, (*worlds, 1))
        fingers = GROUPS[torch.randint(len(GROUPS), worlds)].repeat_interleave(3, dim=-1)
        plays = torch.rand(*worlds, 1) < self.settings.gait
        stretch = torch.randint(self.settings.shortest, self.settings.gait_longest + 1, (*worlds, 1))
        walk = torch.randint(len(self._walks), worlds)
        target = 2.0 * torch.rand(*worlds, 12) - 1.0
        self._held = torch.where(begins, torch.where(plays, stretch, steps), self._held)
        self._fingers = torch.where(begins, fingers | plays, self._fingers)
        self._target = torch.where(begins, target, self._target)
        once = begins.squeeze(-1)
        self._walk = torch.where(once, torch.where(plays.squeeze(-1), walk, HOLDS), self._walk)
        self._clock = self._clock.masked_fill(once, 0)

    def _call(self, next_tensordict: TensorDictBase) -> TensorDictBase:
        next_tensordict.set("exploring", self._exploring)
        return next_tensordict.set("action_taken", self._taken)

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Adds the two keys."""
        worlds = observation_spec.shape
        observation_spec["exploring"] = Categorical(2, shape=(*worlds, 1), dtype=torch.bool)
        observation_spec["action_taken"] = Unbounded((*worlds, 12))
        return observation_spec
