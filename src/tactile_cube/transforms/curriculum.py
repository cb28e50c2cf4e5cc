"""Curriculum: the conditions of episodes, from easy to hard as training goes on."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from tensordict import TensorDictBase
from torchrl.envs.transforms import Transform

from tactile_cube.env import Conditions
from tactile_cube.errors import InputError


@dataclass(frozen=True)
class Ramps:
    """Where each condition starts; it ends, linearly in the progress, at the task's own value.

    Progress by the angle has no memory: conditions become easier by themselves when the policy gets worse, and a
    resumed training needs nothing but its performance.

    Attributes:
        by: what the progress goes by: environment "steps", the mean final "angle" of recent episodes [rad], or None:
            the task's own conditions from the first step on.
        low: up to here conditions are those of the start; steps or [rad].
        high: from here on they are the task's own.
        filter_time: T_s at the start [s]; None leaves the task's value throughout.
        gravity_scale: part of the cube's weight at the start; None leaves the task's value throughout.
        penalty_scale: factor on the weights of height, plane and tilt at the start; 1 at the end.

    The default is published. Source: website, table of the learning parameters.
    """

    by: Literal["steps", "angle"] | None = "steps"
    low: float = 2e6
    high: float = 6e6
    filter_time: float | None = 0.12
    gravity_scale: float | None = 0.05
    penalty_scale: float = 1.0

    def __post_init__(self) -> None:
        """Refuse values without a meaning."""
        if self.by not in ("steps", "angle", None):
            raise InputError(f"curriculum.by is {self.by!r}; give steps, angle or null")
        if not self.low < self.high:
            raise InputError(f"curriculum.low {self.low} is not below curriculum.high {self.high}")
        if self.filter_time is not None and not self.filter_time > 0.0:
            raise InputError(f"curriculum.filter_time is {self.filter_time} s; give a time constant above 0")
        for key in ("gravity_scale", "penalty_scale"):
            value = getattr(self, key)
            if value is not None and not value >= 0.0:
                raise InputError(f"curriculum.{key} is {value}; give a scale >= 0")

    def conditions(self, steps: int, angle: float, final: Conditions) -> Conditions:
        """Return the conditions after `steps` with mean final `angle` [rad] on the way to `final`."""
        if self.by is None:
            return final
        progress = ((steps if self.by == "steps" else angle) - self.low) / (self.high - self.low)
        progress = min(1.0, max(0.0, progress))

        def between(start: float | None, end: float) -> float:
            return end if start is None else start + progress * (end - start)

        return Conditions(
            filter_time=between(self.filter_time, final.filter_time),
            gravity_scale=between(self.gravity_scale, final.gravity_scale),
            penalty_scale=between(self.penalty_scale, final.penalty_scale),
        )


class Curriculum(Transform):  # type: ignore[misc]
    """Sets `conditions` of the environment below it, and `odds` of steered constants, as training goes on.

    They hold for episodes that start from then on. A collector reaches it as
    `collector.map_fn("env.transform[0].set_progress", [(steps, angle)])`, where it is the first transform.

    Example:
        >>> env = TransformedEnv(worlds, Curriculum(Ramps(by="angle", low=1.6, high=4.0)))
        >>> env.transform.set_progress(20_000, 2.5)
    """

    def __init__(self, ramps: Ramps | None = None) -> None:
        """Follow `ramps`; None: the task's own conditions throughout."""
        super().__init__()
        self.ramps = ramps or Ramps(by=None)
        self._now: tuple[int, float, NDArray[np.float64] | None] = (0, 0.0, None)

    def set_progress(self, steps: int, angle: float, odds: NDArray[np.float64] | None = None) -> Conditions:
        """Go on to `steps` of all worlds together and the mean final `angle` [rad]; gives the conditions in force.

        Args:
            steps: environment steps so far.
            angle: mean final angle of recent episodes [rad].
            odds: of the parts of the ranges of steered constants; None: as they are.
        """
        self._now = (steps, angle, odds)
        worlds = self.container.base_env
        if odds is not None:
            worlds.odds = odds
        conditions = self.ramps.conditions(steps, angle, worlds.final_conditions)
        worlds.conditions = conditions
        return conditions

    def _reset_env_preprocess(self, tensordict: TensorDictBase | None) -> TensorDictBase | None:
        self.set_progress(*self._now)
        return tensordict
