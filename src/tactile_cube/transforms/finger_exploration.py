"""Extra exploration that lifts fingers: noise on single joints hardly ever lets go of the cube and grasps it anew."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.data import Categorical, Composite, Unbounded
from torchrl.envs.transforms import Transform

from tactile_cube.errors import InputError
from tactile_cube.hand.gait import GaitRanges
from tactile_cube.transforms.disturbances import reset_mask


def finger_groups(fingers: int, single: bool = False) -> Tensor:
    """Fingers that move together (groups, fingers): each alone, every second one where there are four, all (twice).

    Of four fingers those are the opposing pairs: ring and fore, middle and thumb. With `single` each alone is all.
    """
    alone = [[finger == one for finger in range(fingers)] for one in range(fingers)]
    if single:
        return torch.tensor(alone)
    pairs = [[finger % 2 == first for finger in range(fingers)] for first in (0, 1)] if fingers == 4 else []
    return torch.tensor([*alone, *pairs, *[[True] * fingers] * 2])


@dataclass(frozen=True)
class Exploration:
    """Extra exploration in a part of the episodes.

    Attributes:
        episodes: part of the episodes that explore.
        probability: with which a step of such an episode begins to hold a random target.
        shortest: fewest steps that a target is held.
        longest: most steps that it is held.
        single: only one finger at a time does; else also pairs and all of them, which in the air costs the object.
        demonstrations: part of the episodes in which a scripted gait acts. There the policy takes over where an
            exploring one would hold a target, and for as long.
        noise: standard deviation of the noise on the gait's actions.
        gaits: the gaits that act there.
    """

    episodes: float = 0.3
    probability: float = 0.06
    shortest: int = 2
    longest: int = 7
    single: bool = False
    demonstrations: float = 0.0
    noise: float = 0.1
    gaits: GaitRanges | None = None

    def __post_init__(self) -> None:
        """Refuses values without a meaning."""
        for key in ("episodes", "probability", "demonstrations"):
            if not 0.0 <= getattr(self, key) <= 1.0:
                raise InputError(f"exploration.{key} is {getattr(self, key)}; give a number in [0, 1]")
        if self.extra > 1.0:
            raise InputError(
                f"exploration.episodes={self.episodes} and demonstrations={self.demonstrations} are more than all"
            )
        if not 1 <= self.shortest <= self.longest:
            raise InputError(
                f"exploration holds {self.shortest} to {self.longest} steps; give 1 <= shortest <= longest"
            )
        if not self.noise >= 0.0:
            raise InputError(f"exploration.noise is {self.noise}; give a standard deviation >= 0")

    @property
    def extra(self) -> float:
        """Part of the episodes in which more than the policy acts."""
        return self.episodes + self.demonstrations


class FingerExploration(Transform):  # type: ignore[misc]
    """In some episodes a group of fingers holds a random target for a few steps instead of what the policy says.

    In others a scripted gait acts. Adds "exploring" (1), constant in an episode, so that statistics can
    leave such episodes out, "demonstrated" (1), true after a step in which the gait acted, and "action_taken"
    (joints), the action after this transform: the one that a replay must store. Draws from torch's global generator,
    the same number of draws at every step.

    Example:
        >>> env = TransformedEnv(worlds, FingerExploration(Exploration(episodes=0.3)))
    """

    def __init__(
        self,
        exploration: Exploration,
        gaits: Tensor | None = None,
        fingers: int = 4,
        joints_per_finger: int = 3,
    ) -> None:
        """Explores as `exploration` says; demonstrations play `gaits`, actions (gaits, steps, joints)."""
        super().__init__(out_keys=["exploring", "demonstrated", "action_taken"])
        self.settings = exploration
        self._groups, self._per_finger = finger_groups(fingers, exploration.single), joints_per_finger
        self._joints = fingers * joints_per_finger
        self._gaits = torch.zeros(1, 1, self._joints) if gaits is None else gaits
        self._exploring = self._demonstrating = self._demonstrated = self._held = torch.zeros(0)
        self._gait = self._clock = self._target = self._fingers = self._taken = torch.zeros(0)

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        mask = reset_mask(tensordict, tensordict_reset)
        worlds = mask.shape[:-1]
        if self._exploring.shape != mask.shape:
            self._exploring = self._demonstrating = self._demonstrated = torch.zeros_like(mask)
            self._held = self._gait = self._clock = torch.zeros_like(mask, dtype=torch.int64)
            self._target = self._taken = torch.zeros(*worlds, self._joints)
            self._fingers = torch.zeros(*worlds, self._joints, dtype=torch.bool)
        draw = torch.rand(mask.shape)
        demonstrating = (draw >= self.settings.episodes) & (draw < self.settings.extra)
        self._exploring = torch.where(mask, draw < self.settings.extra, self._exploring)
        self._demonstrating = torch.where(mask, demonstrating, self._demonstrating)
        self._gait = torch.where(mask, torch.randint(len(self._gaits), mask.shape), self._gait)
        self._clock = self._clock.masked_fill(mask, 0)
        self._held = self._held.masked_fill(mask, 0)
        self._demonstrated = self._demonstrated & ~mask
        self._taken = self._taken.masked_fill(mask, 0.0)
        return self._call(tensordict_reset)

    def _inv_call(self, tensordict: TensorDictBase) -> TensorDictBase:
        policy = tensordict.get("action")
        self._begin(policy.shape[:-1])
        gait = self._gaits[self._gait, self._clock].squeeze(-2)
        shown = gait + self.settings.noise * torch.randn(policy.shape)
        usual = torch.where(self._demonstrating, shown.clamp(-1.0, 1.0), policy)
        instead = torch.where(self._demonstrating, policy, torch.where(self._fingers, self._target, policy))
        self._taken = torch.where(self._held > 0, instead, usual)
        self._demonstrated = self._demonstrating & (self._held == 0)
        self._held = (self._held - 1).clamp_min(0)
        self._clock = (self._clock + 1).clamp_max(self._gaits.shape[1] - 1)
        return tensordict.set("action", self._taken)

    def _begin(self, worlds: torch.Size) -> None:
        """Lets exploring worlds that hold nothing begin to hold, with the probability of a step."""
        begins = (torch.rand(*worlds, 1) < self.settings.probability) & self._exploring & (self._held == 0)
        steps = torch.randint(self.settings.shortest, self.settings.longest + 1, (*worlds, 1))
        fingers = self._groups[torch.randint(len(self._groups), worlds)].repeat_interleave(self._per_finger, dim=-1)
        target = 2.0 * torch.rand(*worlds, self._joints) - 1.0
        self._held = torch.where(begins, steps, self._held)
        self._fingers = torch.where(begins, fingers, self._fingers)
        self._target = torch.where(begins, target, self._target)

    def _call(self, next_tensordict: TensorDictBase) -> TensorDictBase:
        next_tensordict.set("exploring", self._exploring)
        next_tensordict.set("demonstrated", self._demonstrated)
        return next_tensordict.set("action_taken", self._taken)

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Adds the three keys."""
        worlds = observation_spec.shape
        observation_spec["exploring"] = Categorical(2, shape=(*worlds, 1), dtype=torch.bool)
        observation_spec["demonstrated"] = Categorical(2, shape=(*worlds, 1), dtype=torch.bool)
        observation_spec["action_taken"] = Unbounded((*worlds, self._joints))
        return observation_spec
