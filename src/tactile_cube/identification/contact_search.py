"""The value of one parameter with which the simulation follows trials best: a coarse grid, then ever narrower ones.

How far two slips are apart in time has a corner where they coincide, so slopes of the error are of no use here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tactile_cube.identification.contact_trial import ContactTrial
from tactile_cube.identification.contact_unknown import Unknown
from tactile_cube.measurement.hand_replay import Contact

NARROWINGS = 4  # each halves the spacing of the grid
TELLING = 1.25  # the cost must rise by this factor on both sides of its minimum


@dataclass(frozen=True)
class Opinion:
    """What the trials of one initialisation say.

    Attributes:
        trials: their names.
        initialisation: which one.
        value: the best.
        telling: whether the trials are followed worse on both sides of it; otherwise they do not know.
        cost: at the best, a trial.
    """

    trials: str
    initialisation: int
    value: float
    telling: bool
    cost: float


def first_value(trials: Sequence[ContactTrial], contact: Contact, unknown: Unknown) -> float | None:
    """The value of a coarse grid that suits all trials best, or None where no value is better than another."""
    grid = unknown.grid()
    total = np.array([pooled_cost(trials, unknown.put(contact, float(value))) for value in grid])
    return float(grid[np.argmin(total)]) if np.ptp(total) > np.log(TELLING) else None


def narrowed(
    trials: Sequence[ContactTrial], contact: Contact, unknown: Unknown, around: float, times: int = NARROWINGS
) -> dict[float, float]:
    """Value -> pooled cost on grids about the best value so far, each half as wide as the one before."""
    costs: dict[float, float] = {}
    best, spacing = unknown.scaled(around), unknown.spacing
    for _ in range(times):
        spacing /= 2
        for scaled in (best, best - spacing, best + spacing):
            value = unknown.unscaled(scaled)
            if value not in costs:
                costs[value] = pooled_cost(trials, unknown.put(contact, value))
        best = unknown.scaled(best_of(costs))
    return costs


def best_of(costs: Mapping[float, float]) -> float:
    """The value of the least cost."""
    return min(costs, key=costs.__getitem__)


def pooled_cost(trials: Sequence[ContactTrial], contact: Contact) -> float:
    """Sum of the logarithms of the costs: each trial counts alike, however badly it is followed."""
    return float(np.sum(np.log([trial.cost(contact) for trial in trials])))


def opinion(trials: Sequence[ContactTrial], contact: Contact, unknown: Unknown, around: float) -> Opinion:
    """The value near another one that suits trials of one initialisation best."""
    costs = narrowed(trials, contact, unknown, around)
    found = best_of(costs)
    rises = [max((cost for value, cost in costs.items() if side * (value - found) > 0), default=costs[found])
             for side in (-1, 1)]  # fmt: skip
    telling = bool(min(rises) - costs[found] > np.log(TELLING) * len(trials)) or _at_neutral(unknown, found)
    name = " ".join(one.trial.name for one in trials)
    return Opinion(name, trials[0].trial.initialisation, found, telling, float(np.exp(costs[found] / len(trials))))


def _at_neutral(unknown: Unknown, value: float) -> bool:
    """Whether a value is neutral and there is nothing beyond it."""
    p = unknown.parameter
    return value == p.neutral and value in (p.low, p.high)
