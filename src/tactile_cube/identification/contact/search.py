"""The value of one parameter with which the simulation follows trials best: a coarse grid, then ever narrower ones.

How far two slips are apart in time has a corner where they coincide, so slopes of the error are of no use here.
Effects of which nothing slips have their numbers found together: see contact_together.py.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tactile_cube.identification.contact.trial import ContactTrial
from tactile_cube.identification.contact.unknown import Unknown
from tactile_cube.measurement.replay.hand_replay import Contact
from tactile_cube.simulation.contact_effects import ContactEffect

NARROWINGS = 4  # each halves the spacing of the grid
TELLING = 1.25  # the cost must rise by this factor on both sides of its minimum
MISFIT_COUNTS = 10.0  # as so many measured numbers beside the joint offsets, where these tell


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
    total = np.array([pooled_cost(trials, unknown.put(contact, float(value)), unknown.effect) for value in grid])
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
                costs[value] = pooled_cost(trials, unknown.put(contact, value), unknown.effect)
        best = unknown.scaled(best_of(costs))
    return costs


def best_of(costs: Mapping[float, float]) -> float:
    """The value of the least cost."""
    return min(costs, key=costs.__getitem__)


def pooled_cost(trials: Sequence[ContactTrial], contact: Contact, effect: type[ContactEffect]) -> float:
    """What is to be least: the sum of the logarithms of the costs, so that each trial counts alike.

    For an effect that shows in the offsets: how improbable these are, trials of one initialisation sharing theirs.
    """
    misfit = float(np.sum(np.log([trial.cost(contact) for trial in trials])))
    if effect.shows_in != "offsets":
        return misfit
    return sum(prior_penalties(trials, contact).values()) + MISFIT_COUNTS * misfit / len(trials)


def prior_penalties(trials: Sequence[ContactTrial], contact: Contact) -> dict[int, float]:
    """Initialisation -> how improbable the joint offsets are that its trials need."""
    by_initialisation: dict[int, list[float]] = {}
    for one in trials:
        by_initialisation.setdefault(one.trial.initialisation, []).append(one.prior_penalty(contact))
    return {key: float(np.mean(values)) for key, values in by_initialisation.items()}


def opinion(trials: Sequence[ContactTrial], contact: Contact, unknown: Unknown, around: float) -> Opinion:
    """The value near another one that suits trials of one initialisation best."""
    costs = narrowed(trials, contact, unknown, around)
    found = best_of(costs)
    rises = [max((cost for value, cost in costs.items() if side * (value - found) > 0), default=costs[found])
             for side in (-1, 1)]  # fmt: skip
    telling = bool(min(rises) - costs[found] > np.log(TELLING) * len(trials)) or _at_neutral(unknown, found)
    return opinion_of(trials, unknown.put(contact, found), found, telling)


def opinion_of(trials: Sequence[ContactTrial], contact: Contact, value: float, telling: bool) -> Opinion:
    """A value as the opinion of some trials."""
    name = " ".join(one.trial.name for one in trials)
    cost = float(np.exp(np.mean(np.log([one.cost(contact) for one in trials]))))
    return Opinion(name, trials[0].trial.initialisation, value, telling, cost)


def _at_neutral(unknown: Unknown, value: float) -> bool:
    """Whether a value is neutral and there is nothing beyond it."""
    p = unknown.parameter
    return value == p.neutral and value in (p.low, p.high)
