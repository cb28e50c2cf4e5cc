"""In which of the worlds that were drawn does a policy lose its object?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import mannwhitneyu

from tactile_cube.evaluation.verdict import EpisodeResult

NO_PROPERTY = ("seed", "force_seed")  # where random numbers come from: larger is not more of anything
SIGNIFICANT = 0.05  # for all constants together: one false name in twenty evaluations
LEAST = 5  # episodes lost and kept, below which no test can tell


@dataclass(frozen=True)
class LostWhere:
    """A constant of the world that tells kept objects from lost ones.

    Attributes:
        constant: its name.
        p_value: Mann-Whitney's, times the number of constants that were drawn.
        edges: lowest value, the two that divide the episodes into thirds, and highest [SI].
        kept: objects kept in each third, from the lowest values on.
        episodes: in each third.
    """

    constant: str
    p_value: float
    edges: tuple[float, ...]
    kept: tuple[int, ...]
    episodes: tuple[int, ...]

    @property
    def text(self) -> str:
        """In words."""
        parts = (
            f"{kept} of {count} at {low:.3g} to {high:.3g}"
            for kept, count, low, high in zip(self.kept, self.episodes, self.edges[:-1], self.edges[1:], strict=True)
        )
        return f"kept by {self.constant}: {', '.join(parts)} (p {self.p_value:.1e})"


def drawn(results: Sequence[EpisodeResult]) -> list[str]:
    """Constants that differ between the worlds of the episodes."""
    first = results[0].world
    numbers = [name for name, value in first.items() if isinstance(value, float) and name not in NO_PROPERTY]
    return [name for name in numbers if any(result.world[name] != first[name] for result in results)]


def lost_where(results: Sequence[EpisodeResult]) -> list[LostWhere]:
    """Constants that tell kept objects from lost ones, surest first; none where too few were lost or kept.

    Source of the test: Mann and Whitney, Annals of Mathematical Statistics 18 (1947).
    """
    kept, names = np.array([result.kept for result in results]), drawn(results)
    if min(kept.sum(), (~kept).sum()) < LEAST:
        return []
    found = []
    for name in names:
        values = np.array([float(result.world[name]) for result in results])
        p_value = min(1.0, len(names) * float(mannwhitneyu(values[kept], values[~kept]).pvalue))
        if p_value < SIGNIFICANT:
            thirds = np.array_split(np.argsort(values, kind="stable"), 3)
            low, lower, upper, high = (float(values[k]) for k in (thirds[0][0], *(t[-1] for t in thirds)))
            counts = [int(kept[third].sum()) for third in thirds]
            sizes = [len(third) for third in thirds]
            found.append(LostWhere(name, p_value, (low, lower, upper, high), tuple(counts), tuple(sizes)))
    return sorted(found, key=lambda one: one.p_value)
