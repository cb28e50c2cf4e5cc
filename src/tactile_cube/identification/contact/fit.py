"""Contact effects fitted to trials with an object: each initialisation gives a value, their scatter the interval.

How far two slips are apart in time has a corner where they coincide, so slopes of the error are of no use: the value of
a parameter is found on a coarse grid, then on ever narrower ones. Effects of which nothing slips have their numbers
found together, by `solved`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.drivetrain.model_file import Estimate
from tactile_cube.identification.contact.trial import EVERY, ContactTrial
from tactile_cube.measurement.replay.hand_replay import ContactModel
from tactile_cube.simulation.contact_effects import ContactEffect

Array = NDArray[np.float64]
COARSE, RATIO = 5, 2.3  # least number of values of a first grid; the largest ratio of neighbours
NARROWINGS = 4  # each halves the spacing of the grid
TELLING = 1.25  # the cost must rise by this factor on both sides of its minimum
MISFIT_COUNTS = 10.0  # as so many measured numbers beside the joint offsets, where these tell
STEPS = 3  # of Gauss and Newton
SHARES = (1.0, 0.4)  # of a step that are tried
TRUSTED = 60.0  # measured numbers as which a trial counts, beside one of what is expected of each unknown
KNOWN = 0.5  # standard deviation over what was expected, below which the trials know a number
CONFIDENCE = 0.95
PROVING = 0.9  # of the interval that must leave out the stated value: three initialisations seldom show more
FEW = 3  # trials of a first look
ASKED = 2  # trials of each initialisation, with loads as different as there are
SOLVER = {
    "lateral_friction": 0.03,
    "spinning_friction": 0.03,
    "tip_compliance": 1e-4,
    "object_mass": 0.01,
    "object_com": 1e-2,
    "object_size": 1e-3,
}
"""What a world in steps of 2 ms and 30 iterations shares in all initialisations, so that their scatter does not show
it: of frictions the logarithm, of the rest in their unit. Lateral friction and mass were seen on recordings made in
steps of 1 ms, one each, the centre of mass on two; the others are guesses."""


@dataclass(frozen=True)
class ContactUnknown:
    """One parameter of one effect."""

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

    @property
    def neutral(self) -> float:
        """The value that changes nothing, or the bound next to it."""
        return float(np.clip(self.parameter.neutral, self.parameter.low, self.parameter.high))

    def of(self, contact: ContactModel) -> float:
        """The value of this parameter, neutral where the contact says nothing of it."""
        return contact.values.get(self.effect.name, {}).get(self.parameter.name, self.neutral)

    def put(self, contact: ContactModel, value: float) -> ContactModel:
        """The contact with this parameter at a value."""
        return contact.changed(self.effect.name, **{self.parameter.name: value})


def contact_unknowns(effects: Sequence[type[ContactEffect]]) -> list[ContactUnknown]:
    """Every parameter of some effects."""
    return [ContactUnknown(effect, parameter) for effect in effects for parameter in effect.parameters]


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
    return offset_penalty(trials, contact) + MISFIT_COUNTS * misfit / len(trials)


def offset_penalty(trials: Sequence[ContactTrial], contact: ContactModel) -> float:
    """How improbable the joint offsets are that the trials need, those of one initialisation sharing theirs."""
    groups = grouped(trials, "initialisation")
    return sum(float(np.mean([one.prior_penalty(contact) for one in group])) for group in groups)


def group_estimate(
    trials: Sequence[ContactTrial], contact: ContactModel, unknown: ContactUnknown, around: float
) -> GroupEstimate:
    """The value near another one that suits trials of one initialisation best."""
    costs = narrowed(trials, contact, unknown, around)
    found = best_of(costs)
    rises = [max((cost for value, cost in costs.items() if side * (value - found) > 0), default=costs[found])
             for side in (-1, 1)]  # fmt: skip
    telling = bool(min(rises) - costs[found] > np.log(TELLING) * len(trials))
    telling |= found == unknown.parameter.neutral and found in (unknown.parameter.low, unknown.parameter.high)
    return estimate_of(trials, unknown.put(contact, found), found, telling)


def estimate_of(trials: Sequence[ContactTrial], contact: ContactModel, value: float, telling: bool) -> GroupEstimate:
    """A value as the estimate of some trials."""
    name = " ".join(one.trial.name for one in trials)
    cost = float(np.exp(np.mean(np.log([one.cost(contact) for one in trials]))))
    return GroupEstimate(name, trials[0].trial.initialisation, value, telling, cost)


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
    values = np.array([one.of(contact) for one in wanted])
    slopes = np.zeros((0, len(wanted)))
    for _ in range(STEPS):
        slopes, target = _linearised(trials, contact, wanted, values, typical)
        step = -np.linalg.lstsq(slopes, target, rcond=None)[0] * typical
        before = pooled_cost(trials, contact, wanted[0].effect)
        for share in SHARES:
            tried = _put(contact, wanted, values + share * step)
            if pooled_cost(trials, tried, wanted[0].effect) < before:
                contact = tried
                values = np.array([one.of(tried) for one in wanted])
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


@dataclass(frozen=True)
class ContactFit:
    """What was found.

    Attributes:
        contact: the values.
        estimates: (effect, parameter) -> value with interval.
        by_initialisation: (effect, parameter) -> what each initialisation said.
    """

    contact: ContactModel
    estimates: dict[tuple[str, str], Estimate]
    by_initialisation: dict[tuple[str, str], list[GroupEstimate]]

    def silent(self) -> list[str]:
        """Parameters of which no trial knows anything."""
        return [" ".join(key) for key, said in self.by_initialisation.items() if not any(one.telling for one in said)]

    def shows(self, effect: type[ContactEffect], stated: ContactModel) -> bool:
        """Whether the initialisations agree that a parameter of an effect is another than a contact states."""
        for unknown in contact_unknowns([effect]):
            interval = _interval(unknown, self.by_initialisation[effect.name, unknown.parameter.name], PROVING)
            if interval and abs(interval[0] - unknown.scaled(unknown.of(stated))) > interval[1]:
                return True
        return False


def fit_contact(
    trials: Sequence[ContactTrial],
    effects: Sequence[type[ContactEffect]],
    start: ContactModel,
    say: Callable[[str], None] = print,
) -> ContactFit:
    """Fit the parameters of some effects: all of them coarsely, then each with the others as they were found.

    Args:
        trials: with an object.
        effects: what to fit.
        start: values of all other contact effects.
        say: takes progress lines.
    """
    contact, wanted = start, contact_unknowns(effects)
    together = [effect for effect in effects if effect.shows_in == "load"]
    for unknown in wanted:
        if unknown.effect.shows_in == "load":
            contact = unknown.put(contact, unknown.neutral)
            continue
        value = first_value(evenly(shown_by(trials, unknown.effect), FEW), contact, unknown)
        contact = unknown.put(contact, unknown.neutral if value is None else value)
        say(f"{unknown.label}: about {unknown.of(contact):.2g}")
    for effect in together:
        contact, _ = solved(evenly(shown_by(trials, effect), FEW), contact, contact_unknowns([effect]))
    slipping = [one for one in wanted if one.effect not in together]
    kinds = [one.effect.shown_by for one in slipping]
    for unknown in slipping:
        if kinds.count(unknown.effect.shown_by) == 1:
            continue  # no other shows in the same trials, so none must be near before this one is judged
        costs = narrowed(evenly(shown_by(trials, unknown.effect), FEW), contact, unknown, unknown.of(contact))
        contact = unknown.put(contact, best_of(costs))
    by_initialisation: dict[tuple[str, str], list[GroupEstimate]] = {}
    estimates: dict[tuple[str, str], Estimate] = {}
    for effect in effects:
        groups = [evenly(group, ASKED) for group in grouped(shown_by(trials, effect), "initialisation")]
        own = contact_unknowns([effect])
        at_once = [_estimates_of(group, contact, own) for group in groups] if effect in together else []
        for k, unknown in enumerate(own):
            said = (
                [found[k] for found in at_once]
                if at_once
                else [group_estimate(group, contact, unknown, unknown.of(contact)) for group in groups]
            )
            for one in said:
                telling = "" if one.telling else ", but does not show it"
                say(f"{unknown.label}: initialisation {one.initialisation} says {one.value:.3g}{telling}")
            key, estimate = (effect.name, unknown.parameter.name), summarise_fit(unknown, said)
            by_initialisation[key], estimates[key] = said, estimate
            contact = unknown.put(contact, estimate.value)
            unit = "" if estimate.unit == "1" else f" {estimate.unit}"
            say(f"{unknown.label}: {estimate.value:.3g}{unit} [{estimate.low:.3g}, {estimate.high:.3g}]")
    return ContactFit(contact, estimates, by_initialisation)


def _estimates_of(
    trials: Sequence[ContactTrial], contact: ContactModel, wanted: Sequence[ContactUnknown]
) -> list[GroupEstimate]:
    """What the trials of one initialisation say of all parameters of an effect, found together."""
    found, known = solved(trials, contact, wanted)
    return [estimate_of(trials, found, one.of(found), shows) for one, shows in zip(wanted, known, strict=True)]


def shown_by(trials: Sequence[ContactTrial], effect: type[ContactEffect]) -> list[ContactTrial]:
    """The trials of the kinds that show an effect best, or all where there is none."""
    chosen = [one for one in trials if one.trial.kind in effect.shown_by]
    return chosen or list(trials)


def summarise_fit(unknown: ContactUnknown, by_initialisation: Sequence[GroupEstimate]) -> Estimate:
    """Mean of what the initialisations say, with Student's interval of their scatter, no narrower than the last grid.

    Where none knows anything the value is the neutral one and the interval the whole range.
    """
    parameter, interval = unknown.parameter, _interval(unknown, by_initialisation, CONFIDENCE)
    if interval is None:
        return Estimate(value=unknown.neutral, low=parameter.low, high=parameter.high, unit=parameter.unit)
    mean, half = interval
    low, value, high = (unknown.unscaled(mean + side * half) for side in (-1, 0, 1))
    return Estimate(value=value, low=low, high=high, unit=parameter.unit)


def _interval(
    unknown: ContactUnknown, by_initialisation: Sequence[GroupEstimate], confidence: float
) -> tuple[float, float] | None:
    """Mean and half of the interval on the scale of `scaled`; None where no initialisation knows anything."""
    values = [unknown.scaled(one.value) for one in by_initialisation if one.telling]
    if not values:
        return None
    half = unknown.spacing
    if len(values) > 1:
        scatter = float(np.std(values, ddof=1)) / np.sqrt(len(values))
        half = float(stats.t.ppf((1 + confidence) / 2, len(values) - 1)) * scatter
        half = max(float(np.hypot(half, SOLVER[unknown.effect.name])), unknown.spacing / 2**NARROWINGS)
    return float(np.mean(values)), half


def grouped(trials: Sequence[ContactTrial], key: str) -> list[list[ContactTrial]]:
    """Trials of the same `initialisation`, which share their joint offsets and so count as one, or `kind`."""
    groups: dict[object, list[ContactTrial]] = {}
    for one in trials:
        groups.setdefault(getattr(one.trial, key), []).append(one)
    return list(groups.values())


def evenly(trials: Sequence[ContactTrial], count: int) -> list[ContactTrial]:
    """At most `count` of them, from as many initialisations and with as many loads as possible."""
    chosen = np.linspace(0, len(trials) - 1, min(count, len(trials))).round().astype(int)
    return [trials[index] for index in chosen]
