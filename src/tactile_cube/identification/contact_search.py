"""What one trial says of one parameter: the value at which the simulation follows it best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tactile_cube.identification.contact_trial import ContactTrial
from tactile_cube.identification.contact_unknown import REFINEMENTS, Unknown
from tactile_cube.measurement.hand_replay import Contact

GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
TELLING = 1.5  # the cost must rise by this factor on both sides of its minimum


@dataclass(frozen=True)
class TrialEstimate:
    """One trial's opinion.

    Attributes:
        initialisation: of the trial.
        value: the best.
        telling: whether the trial becomes worse on both sides of it; otherwise it does not know.
        cost: at the best.
    """

    initialisation: int
    value: float
    telling: bool
    cost: float


def best_value(trial: ContactTrial, contact: Contact, unknown: Unknown, around: float | None = None) -> TrialEstimate:
    """The value of one parameter that suits one trial best: a grid, then the golden section about its best.

    When a load slips is a function of friction without corners, but how far two slips are apart has one at its minimum;
    so slopes are of no use here.
    """
    costs: dict[float, float] = {}

    def cost(scaled: float) -> float:
        if scaled not in costs:
            costs[scaled] = trial.cost(unknown.put(contact, unknown.unscaled(scaled)))
        return costs[scaled]

    trial.settle(contact if around is None else unknown.put(contact, around))
    grid = sorted(unknown.scaled(float(value)) for value in unknown.grid(around))
    best = int(np.argmin([cost(value) for value in grid]))
    coarse = dict(costs)
    trial.settle(unknown.put(contact, unknown.unscaled(grid[best])))
    costs.clear()
    cost(grid[best])
    _golden_section(cost, grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    found = min(costs, key=lambda value: costs[value])
    costs |= {value: one for value, one in coarse.items() if value not in costs}
    least = costs[found]
    sides = [max((c for v, c in costs.items() if (v - found) * side > 0), default=least) for side in (-1, 1)]
    return TrialEstimate(trial.trial.initialisation, unknown.unscaled(found), min(sides) > TELLING * least, least)


def _golden_section(cost: Callable[[float], float], low: float, high: float) -> None:
    inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    for _ in range(REFINEMENTS):
        if cost(inner[0]) < cost(inner[1]):
            high = inner[1]
            inner = [high - GOLDEN * (high - low), inner[0]]
        else:
            low = inner[0]
            inner = [inner[1], low + GOLDEN * (high - low)]
