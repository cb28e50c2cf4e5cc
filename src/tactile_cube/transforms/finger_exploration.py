"""Extra exploration that lifts fingers: noise on single joints hardly ever lets go of the cube and grasps it anew."""

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
    """Return fingers that move together (groups, fingers): each alone, every second one of four, all (twice).

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
        probability: with which a step of one of them begins to hold a random target.
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
        """Refuse values without a meaning."""
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
        """Explore as `exploration` says; demonstrations play `gaits`, actions (gaits, steps, joints)."""
        super().__init__(out_keys=["exploring", "demonstrated", "action_taken"])
        self.settings = exploration
        self._groups, self._per_finger = finger_groups(fingers, exploration.single), joints_per_finger
        self._joints = fingers * joints_per_finger
        self._gaits = torch.zeros(1, 1, self._joints) if gaits is None else gaits
        self._state: dict[str, Tensor] = {}

    def _reset(self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase) -> TensorDictBase:
        mask = reset_mask(tensordict, tensordict_reset)
        draw, settings, joints = torch.rand(mask.shape), self.settings, torch.zeros(*mask.shape[:-1], self._joints)
        fresh = {
            "exploring": draw < settings.extra,
            "demonstrating": (draw >= settings.episodes) & (draw < settings.extra),
            "gait": torch.randint(len(self._gaits), mask.shape),
            "clock": torch.zeros(mask.shape, dtype=torch.int64),
            "held": torch.zeros(mask.shape, dtype=torch.int64),
            "demonstrated": torch.zeros_like(mask),
            "taken": joints,
            "target": joints,
            "fingers": joints.bool(),
        }
        self._state = {key: torch.where(mask, one, self._state.get(key, one)) for key, one in fresh.items()}
        return self._call(tensordict_reset)

    def _inv_call(self, tensordict: TensorDictBase) -> TensorDictBase:
        policy, state, settings = tensordict.get("action"), self._state, self.settings
        self._begin(policy.shape[:-1])
        gait = self._gaits[state["gait"], state["clock"]].squeeze(-2)
        shown = (gait + settings.noise * torch.randn(policy.shape)).clamp(-1.0, 1.0)
        showing, holding = state["demonstrating"], state["held"] > 0
        usual = torch.where(showing, shown, policy)
        instead = torch.where(~showing & state["fingers"], state["target"], policy)
        state["taken"] = torch.where(holding, instead, usual)
        state["demonstrated"] = showing & ~holding
        state["held"] = (state["held"] - 1).clamp_min(0)
        state["clock"] = (state["clock"] + 1).clamp_max(self._gaits.shape[1] - 1)
        return tensordict.set("action", state["taken"])

    def _begin(self, worlds: torch.Size) -> None:
        """Let exploring worlds that hold nothing begin to hold, with the probability of a step."""
        state, settings = self._state, self.settings
        begins = (torch.rand(*worlds, 1) < settings.probability) & state["exploring"] & (state["held"] == 0)
        steps = torch.randint(settings.shortest, settings.longest + 1, (*worlds, 1))
        fingers = self._groups[torch.randint(len(self._groups), worlds)].repeat_interleave(self._per_finger, dim=-1)
        target = 2.0 * torch.rand(*worlds, self._joints) - 1.0
        for key, value in {"held": steps, "fingers": fingers, "target": target}.items():
            state[key] = torch.where(begins, value, state[key])

    def _call(self, next_tensordict: TensorDictBase) -> TensorDictBase:
        next_tensordict.set("exploring", self._state["exploring"])
        next_tensordict.set("demonstrated", self._state["demonstrated"])
        return next_tensordict.set("action_taken", self._state["taken"])

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Add the three keys."""
        worlds = observation_spec.shape
        observation_spec["exploring"] = Categorical(2, shape=(*worlds, 1), dtype=torch.bool)
        observation_spec["demonstrated"] = Categorical(2, shape=(*worlds, 1), dtype=torch.bool)
        observation_spec["action_taken"] = Unbounded((*worlds, self._joints))
        return observation_spec
