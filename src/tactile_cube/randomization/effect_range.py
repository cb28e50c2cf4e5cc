"""An effect of the drivetrain whose numbers are known within intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tactile_cube.drivetrain.effects import Effect
from tactile_cube.randomization.distributions import Distribution, sample


@dataclass(frozen=True)
class EffectRange:
    """One effect at one joint; each episode draws its parameters.

    Attributes:
        effect: class of the effect; not one that changes the mechanism, whose bodies are built once.
        joint: as the world names it, e.g. `ring_q2`.
        parameters: distribution of each parameter, in SI units.
    """

    effect: type[Effect]
    joint: str
    parameters: Mapping[str, Distribution]

    def draw(self, rng: np.random.Generator) -> Effect:
        """The effect of one episode."""
        return self.effect(self.joint, **{key: float(sample(one, rng)) for key, one in self.parameters.items()})
