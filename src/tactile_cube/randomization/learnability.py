"""Which worlds are drawn how often: those most that a policy sometimes masters, and sometimes does not."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tactile_cube.randomization.distributions import Distribution

Array = NDArray[np.float64]

PARTS = 8
"""Equally likely parts of the range of each constant."""
RATE = 0.05
"""Weight of one more episode: a part remembers its last twenty or so."""


class Learnability:
    """The share of cubes lost in each part of the range of each constant.

    A part is drawn in proportion to p (1 - p), where p is that share: little where the policy holds every cube already
    or cannot hold one yet. So the worlds widen as it masters them, and what it has mastered makes room. The rest of
    the draws is uniform. Source: Rutherford et al., *No Regrets: Investigating and Improving Regret Approximations for
    Curriculum Discovery* (sampling for learnability), NeurIPS 2024; there for whole levels, here for each constant.

    Attributes:
        ranges: names of the constants, and what they are drawn from.
        share: part of the draws that follow p (1 - p).
        lost: the share p `(constants, PARTS)`; one half where nothing is known.
    """

    def __init__(self, ranges: Mapping[str, Distribution], share: float):
        self.ranges, self.share = dict(ranges), share
        self.lost: Array = np.full((len(self.ranges), PARTS), 0.5)

    def add(self, places: Array, lost: NDArray[np.bool_]) -> None:
        """Take over episodes `(n,)`: where in the ranges their constants lay `(n, constants)`, each in [0, 1)."""
        rows = np.arange(len(self.ranges))
        for place, one in zip(places, lost, strict=True):
            parts = np.minimum((place * PARTS).astype(np.int64), PARTS - 1)
            self.lost[rows, parts] += RATE * (float(one) - self.lost[rows, parts])

    @property
    def odds(self) -> Array:
        """Probability of each part `(constants, PARTS)`; rows sum to 1."""
        score = self.lost * (1.0 - self.lost) + 1e-6
        return np.asarray(self.share * score / score.sum(axis=1, keepdims=True) + (1.0 - self.share) / PARTS)

    @property
    def hardest(self) -> str:
        """Where most cubes are lost, in words; "" without constants."""
        if not self.ranges:
            return ""
        row, part = divmod(int(self.lost.argmax()), PARTS)
        key, drawn = list(self.ranges.items())[row]
        low, high = drawn.quantile(np.array([part, part + 1 - 1e-9]) / PARTS)
        most = f"{key} {low:.2g} to {high:.2g}: {100 * self.lost[row, part]:.0f} %"
        return f"{100 * self.lost.mean():.0f} % lost over all parts, most at {most}"


def drawn_places(odds: Array, rng: np.random.Generator) -> Array:
    """Where in its range each constant lies `(constants,)` in [0, 1), for the probabilities `odds` of its parts."""
    parts = [int(rng.choice(PARTS, p=row)) for row in odds]
    return np.asarray((np.array(parts) + rng.random(len(odds))) / PARTS)
