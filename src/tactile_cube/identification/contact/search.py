"""The value of one parameter with which the simulation follows trials best: a coarse grid, then ever narrower ones.

How far two slips are apart in time has a corner where they coincide, so slopes of the error are of no use here.
Effects of which nothing slips have their numbers found together, by `solved`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.identification.contact.trial import EVERY, ContactTrial
from tactile_cube.measurement.replay.hand_replay import ContactModel
from tactile_cube.simulation.contact_effects import ContactEffect

COARSE, RATIO = 5, 2.3  # least number of values of a first grid; the largest ratio of neighbours


@dataclass(frozen=True)
class ContactUnknown:
    """One parameter of one effect.

    Attributes:
        effect: class of the effect.
        parameter: which of its numbers.
    """

    effect: type[ContactEffect]
    parameter: Parameter

    @property
    def label(self) -> str:
        """For people."""
        one = len(self.effect.parameters) == 1
        return self.effect.name if one else f"{self.effect.name} {self.parameter.name}"

    @property
    def by_factors(self) -> bool:
        """Whether equal factors matter, and not equal differences."""
        return self.parameter.low > 0

    def grid(self) -> Array:
        """Coarse values over all its range."""
        low, high = self.parameter.low, self.parameter.high
        if not self.by_factors:
            return np.linspace(low, high, COARSE)
        count = max(COARSE, int(np.ceil(np.log(high / low) / np.log(RATIO))) + 1)
        return np.asarray(np.geomspace(low, high, count))

    @property
    def spacing(self) -> float:
        """Between neighbours of the grid, on the scale of `scaled`."""
        first, second = self.grid()[:2]
        return self.scaled(float(second)) - self.scaled(float(first))

    def scaled(self, value: float) -> float:
        """The value on the scale in which it is averaged."""
        return float(np.log(value)) if self.by_factors else value

    def unscaled(self, value: float) -> float:
        """The inverse of `scaled`, within the bounds."""
        plain = float(np.exp(value)) if self.by_factors else value
        return float(np.clip(plain, self.parameter.low, self.parameter.high))

    def put(self, contact: ContactModel, value: float) -> ContactModel:
        """The contact with this parameter at a value."""
        return contact.changed(self.effect.name, **{self.parameter.name: value})


def contact_unknowns(effects: list[type[ContactEffect]]) -> list[ContactUnknown]:
    """Every parameter of some effects."""
    return [ContactUnknown(effect, parameter) for effect in effects for parameter in effect.parameters]


NARROWINGS = 4  # each halves the spacing of the grid
TELLING = 1.25  # the cost must rise by this factor on both sides of its minimum
MISFIT_COUNTS = 10.0  # as so many measured numbers beside the joint offsets, where these tell


@dataclass(frozen=True)
class GroupEstimate:
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


def first_value(trials: Sequence[ContactTrial], contact: ContactModel, unknown: ContactUnknown) -> float | None:
    """The value of a coarse grid that suits all trials best, or None where no value is better than another."""
    grid = unknown.grid()
    total = np.array([pooled_cost(trials, unknown.put(contact, float(value)), unknown.effect) for value in grid])
    return float(grid[np.argmin(total)]) if np.ptp(total) > np.log(TELLING) else None


def narrowed(
    trials: Sequence[ContactTrial],
    contact: ContactModel,
    unknown: ContactUnknown,
    around: float,
    times: int = NARROWINGS,
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


def pooled_cost(trials: Sequence[ContactTrial], contact: ContactModel, effect: type[ContactEffect]) -> float:
    """What is to be least: the sum of the logarithms of the costs, so that each trial counts alike.

    For an effect that shows in the offsets: how improbable these are, trials of one initialisation sharing theirs.
    """
    misfit = float(np.sum(np.log([trial.cost(contact) for trial in trials])))
    if effect.shows_in != "offsets":
        return misfit
    return sum(prior_penalties(trials, contact).values()) + MISFIT_COUNTS * misfit / len(trials)


def prior_penalties(trials: Sequence[ContactTrial], contact: ContactModel) -> dict[int, float]:
    """Initialisation -> how improbable the joint offsets are that its trials need."""
    by_initialisation: dict[int, list[float]] = {}
    for one in trials:
        by_initialisation.setdefault(one.trial.initialisation, []).append(one.prior_penalty(contact))
    return {key: float(np.mean(values)) for key, values in by_initialisation.items()}


def group_estimate(
    trials: Sequence[ContactTrial], contact: ContactModel, unknown: ContactUnknown, around: float
) -> GroupEstimate:
    """The value near another one that suits trials of one initialisation best."""
    costs = narrowed(trials, contact, unknown, around)
    found = best_of(costs)
    rises = [max((cost for value, cost in costs.items() if side * (value - found) > 0), default=costs[found])
             for side in (-1, 1)]  # fmt: skip
    telling = bool(min(rises) - costs[found] > np.log(TELLING) * len(trials)) or _at_neutral(unknown, found)
    return estimate_of(trials, unknown.put(contact, found), found, telling)


def estimate_of(trials: Sequence[ContactTrial], contact: ContactModel, value: float, telling: bool) -> GroupEstimate:
    """A value as the estimate of some trials."""
    name = " ".join(one.trial.name for one in trials)
    cost = float(np.exp(np.mean(np.log([one.cost(contact) for one in trials]))))
    return GroupEstimate(name, trials[0].trial.initialisation, value, telling, cost)


def _at_neutral(unknown: ContactUnknown, value: float) -> bool:
    """Whether a value is neutral and there is nothing beyond it."""
    p = unknown.parameter
    return value == p.neutral and value in (p.low, p.high)


Array = NDArray[np.float64]
STEPS = 3  # of Gauss and Newton
SHARES = (1.0, 0.4)  # of a step that are tried
TRUSTED = 60.0  # measured numbers as which a trial counts, beside one of what is expected of each unknown
KNOWN = 0.5  # standard deviation over what was expected, below which the trials know a number


def solved(
    trials: Sequence[ContactTrial], contact: ContactModel, wanted: Sequence[ContactUnknown]
) -> tuple[ContactModel, list[bool]]:
    """The contact with all parameters of an effect at the values that suit the trials best, and which of them show.

    Args:
        trials: to fit.
        contact: where to start.
        wanted: all parameters of one effect, none of them by factors.
    """
    typical = np.array([one.parameter.typical for one in wanted])
    values = np.array([contact.values.get(one.effect.name, {}).get(one.parameter.name, 0.0) for one in wanted])
    slopes = np.zeros((0, len(wanted)))
    for _ in range(STEPS):
        slopes, target = _linearised(trials, contact, wanted, values, typical)
        step = -np.linalg.lstsq(slopes, target, rcond=None)[0] * typical
        before = pooled_cost(trials, contact, wanted[0].effect)
        for share in SHARES:
            tried = _put(contact, wanted, values + share * step)
            if pooled_cost(trials, tried, wanted[0].effect) < before:
                contact = tried
                values = np.array([tried.values[one.effect.name][one.parameter.name] for one in wanted])
                break
        else:
            break
    spread = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    return contact, [bool(one < KNOWN) for one in spread]


def _linearised(
    trials: Sequence[ContactTrial],
    contact: ContactModel,
    wanted: Sequence[ContactUnknown],
    values: Array,
    typical: Array,
) -> tuple[Array, Array]:
    """Slopes (R, P) per typical value, and residual (R,), each trial in units of its own error; expectations below."""
    base = [_seen(one, contact) for one in trials]
    weights = [np.sqrt(TRUSTED / len(one)) / max(float(np.sqrt(np.mean(one**2))), 1e-9) for one in base]
    columns = []
    for k, unknown in enumerate(wanted):
        side = 1.0 if values[k] + typical[k] <= unknown.parameter.high else -1.0
        moved = unknown.put(_put(contact, wanted, values), float(values[k] + side * typical[k]))
        change = [side * w * (_seen(one, moved) - b) for one, b, w in zip(trials, base, weights, strict=True)]
        columns.append(np.concatenate(change))
    slopes = np.vstack([np.stack(columns, axis=1), np.eye(len(wanted))])
    residual = np.concatenate([w * b for b, w in zip(base, weights, strict=True)])
    return slopes, np.concatenate([residual, values / typical])


def _seen(trial: ContactTrial, contact: ContactModel) -> Array:
    return trial.residual(contact)[trial.trial.valid][::EVERY].ravel()


def _put(contact: ContactModel, wanted: Sequence[ContactUnknown], values: Array) -> ContactModel:
    for unknown, value in zip(wanted, values, strict=True):
        contact = unknown.put(contact, unknown.unscaled(float(value)))
    return contact
