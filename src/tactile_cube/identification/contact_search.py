"""The value of one parameter with which the simulation follows trials best: on a grid for all, then for each trial.

How far two slips are apart in time has a corner where they coincide, so slopes of the error are of no use here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tactile_cube.identification.contact_trial import ContactTrial
from tactile_cube.identification.contact_unknown import Unknown
from tactile_cube.measurement.hand_replay import Contact

GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
REFINEMENTS = 5
TELLING = 1.25  # the cost must rise by this factor on both sides of its minimum


@dataclass(frozen=True)
class TrialEstimate:
    """One trial's opinion.

    Attributes:
        trial: its name.
        initialisation: of the trial.
        value: the best.
        telling: whether the trial becomes worse on both sides of it; otherwise it does not know.
        cost: at the best.
    """

    trial: str
    initialisation: int
    value: float
    telling: bool
    cost: float


def first_value(trials: Sequence[ContactTrial], contact: Contact, unknown: Unknown) -> float | None:
    """The value of a coarse grid that suits all trials best, or None where no value is better than another.

    The trials must be settled.
    """
    grid = unknown.grid()
    total = np.array([pooled_cost(trials, unknown.put(contact, float(value))) for value in grid])
    return float(grid[np.argmin(total)]) if np.ptp(total) > np.log(TELLING) else None


def refined_value(trials: Sequence[ContactTrial], contact: Contact, unknown: Unknown, around: float) -> float:
    """The value between the neighbours of a coarse one that suits all trials best."""
    near = unknown.put(contact, around)
    for trial in trials:
        trial.settle(near, rounds=1)
    costs: dict[float, float] = {}

    def cost(scaled: float) -> float:
        if scaled not in costs:
            costs[scaled] = pooled_cost(trials, unknown.put(contact, unknown.unscaled(scaled)))
        return costs[scaled]

    grid = sorted(unknown.scaled(float(value)) for value in unknown.grid())
    middle = unknown.scaled(around)
    cost(middle)
    lower, upper = [v for v in grid if v < middle - 1e-9], [v for v in grid if v > middle + 1e-9]
    _golden_section(cost, lower[-1] if lower else middle, upper[0] if upper else middle)
    return unknown.unscaled(min(costs, key=lambda value: costs[value]))


def pooled_cost(trials: Sequence[ContactTrial], contact: Contact) -> float:
    """Sum of the logarithms of the costs: each trial counts alike, however badly it is followed."""
    return float(np.sum(np.log([trial.cost(contact) for trial in trials])))


def best_value(trial: ContactTrial, contact: Contact, unknown: Unknown, around: float) -> TrialEstimate:
    """The value near another one that suits one trial best: a grid, then the golden section about its best."""
    costs: dict[float, float] = {}

    def cost(scaled: float) -> float:
        if scaled not in costs:
            costs[scaled] = trial.cost(unknown.put(contact, unknown.unscaled(scaled)))
        return costs[scaled]

    trial.settle(unknown.put(contact, around), rounds=1)
    grid = sorted(unknown.scaled(float(value)) for value in unknown.grid(around))
    best = int(np.argmin([cost(value) for value in grid]))
    trial.settle(unknown.put(contact, unknown.unscaled(grid[best])), rounds=1)
    before = {value: costs.pop(value) for value in grid}
    cost(grid[best])
    _golden_section(cost, grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    found = min(costs, key=lambda value: costs[value])
    least = costs[found]
    costs.update({value: one for value, one in before.items() if value not in costs})
    sides = [max((c for v, c in costs.items() if (v - found) * side > 0), default=least) for side in (-1, 1)]
    name, initialisation = trial.trial.name, trial.trial.initialisation
    return TrialEstimate(name, initialisation, unknown.unscaled(found), min(sides) > TELLING * least, least)


def _golden_section(cost: Callable[[float], float], low: float, high: float) -> None:
    inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    for _ in range(REFINEMENTS):
        if cost(inner[0]) < cost(inner[1]):
            high = inner[1]
            inner = [high - GOLDEN * (high - low), inner[0]]
        else:
            low = inner[0]
            inner = [inner[1], low + GOLDEN * (high - low)]
