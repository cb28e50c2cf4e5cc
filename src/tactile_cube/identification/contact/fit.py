"""Contact effects from trials with an object: each initialisation gives a value, their scatter the interval."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from tactile_cube.drivetrain.model_file import Estimate
from tactile_cube.identification.contact.search import (
    NARROWINGS,
    ContactUnknown,
    GroupEstimate,
    best_of,
    contact_unknowns,
    estimate_of,
    first_value,
    group_estimate,
    narrowed,
    solved,
)
from tactile_cube.identification.contact.trial import ContactTrial
from tactile_cube.measurement.replay.hand_replay import ContactModel
from tactile_cube.simulation.contact_effects import ContactEffect

CONFIDENCE = 0.95
FEW = 3  # trials of a first look
# What a world in steps of 2 ms and 30 iterations shares in all initialisations, so that their scatter does not show it:
# of frictions the logarithm, of the rest in their unit. Lateral friction and mass were seen on recordings made in steps
# of 1 ms, one each, the centre of mass on two; the others are guesses.
SOLVER = {
    "lateral_friction": 0.03,
    "spinning_friction": 0.03,
    "tip_compliance": 1e-4,
    "object_mass": 0.01,
    "object_com": 1e-2,
    "object_size": 1e-3,
}
ASKED = 2  # trials of each initialisation, with loads as different as there are


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
    contact, wanted = start, contact_unknowns(list(effects))
    together = [effect for effect in effects if effect.shows_in == "load"]
    for unknown in wanted:
        if unknown.effect.shows_in == "load":
            contact = unknown.put(contact, _neutral(unknown))
            continue
        value = first_value(evenly(shown_by(trials, unknown.effect), FEW), contact, unknown)
        contact = unknown.put(contact, _neutral(unknown) if value is None else value)
        say(f"{unknown.label}: about {contact.values[unknown.effect.name][unknown.parameter.name]:.2g}")
    for effect in together:
        contact, _ = solved(evenly(shown_by(trials, effect), FEW), contact, contact_unknowns([effect]))
    for unknown in _of_the_same_trials([one for one in wanted if one.effect not in together]):
        costs = narrowed(evenly(shown_by(trials, unknown.effect), FEW), contact, unknown, _value(contact, unknown))
        contact = unknown.put(contact, best_of(costs))
    by_initialisation: dict[tuple[str, str], list[GroupEstimate]] = {}
    estimates: dict[tuple[str, str], Estimate] = {}
    for effect in effects:
        groups = [evenly(group, ASKED) for group in _initialisations(shown_by(trials, effect))]
        own = contact_unknowns([effect])
        at_once = [_estimates_of(group, contact, own) for group in groups] if effect in together else []
        for k, unknown in enumerate(own):
            key = (effect.name, unknown.parameter.name)
            by_initialisation[key] = []
            for g, group in enumerate(groups):
                said = at_once[g][k] if at_once else group_estimate(group, contact, unknown, _value(contact, unknown))
                by_initialisation[key].append(said)
                telling = "" if said.telling else ", but does not show it"
                say(f"{unknown.label}: initialisation {said.initialisation} says {said.value:.3g}{telling}")
            estimates[key] = summarise_fit(unknown, by_initialisation[key])
            contact = unknown.put(contact, estimates[key].value)
            say(f"{unknown.label}: {in_words(estimates[key])}")
    return ContactFit(contact, estimates, by_initialisation)


def _estimates_of(
    trials: Sequence[ContactTrial], contact: ContactModel, wanted: Sequence[ContactUnknown]
) -> list[GroupEstimate]:
    """What the trials of one initialisation say of all parameters of an effect, found together."""
    found, known = solved(trials, contact, wanted)
    return [estimate_of(trials, found, _value(found, one), shows) for one, shows in zip(wanted, known, strict=True)]


def shown_by(trials: Sequence[ContactTrial], effect: type[ContactEffect]) -> list[ContactTrial]:
    """The trials of the kinds that show an effect best, or all where there is none."""
    chosen = [one for one in trials if one.trial.kind in effect.shown_by]
    return chosen or list(trials)


def summarise_fit(unknown: ContactUnknown, by_initialisation: Sequence[GroupEstimate]) -> Estimate:
    """Mean of what the initialisations say, with Student's interval of their scatter, no narrower than the last grid.

    Where none knows anything the value is the neutral one and the interval the whole range.
    """
    parameter = unknown.parameter
    values = [unknown.scaled(one.value) for one in by_initialisation if one.telling]
    if not values:
        return Estimate(value=_neutral(unknown), low=parameter.low, high=parameter.high, unit=parameter.unit)
    half = unknown.spacing
    if len(values) > 1:
        scatter = float(np.std(values, ddof=1)) / np.sqrt(len(values))
        half = float(stats.t.ppf((1 + CONFIDENCE) / 2, len(values) - 1)) * scatter
        half = max(float(np.hypot(half, SOLVER[unknown.effect.name])), unknown.spacing / 2**NARROWINGS)
    mean = float(np.mean(values))
    low, value, high = (unknown.unscaled(mean + side * half) for side in (-1, 0, 1))
    return Estimate(value=value, low=low, high=high, unit=parameter.unit)


def _initialisations(trials: Sequence[ContactTrial]) -> list[list[ContactTrial]]:
    """Trials that share their joint offsets, and so count as one."""
    groups: dict[int, list[ContactTrial]] = {}
    for one in trials:
        groups.setdefault(one.trial.initialisation, []).append(one)
    return list(groups.values())


def _of_the_same_trials(wanted: Sequence[ContactUnknown]) -> list[ContactUnknown]:
    """Those of which others show in the same trials, so that one must be near before the next is judged."""
    kinds = [one.effect.shown_by for one in wanted]
    return [one for one in wanted if kinds.count(one.effect.shown_by) > 1]


def evenly(trials: Sequence[ContactTrial], count: int) -> list[ContactTrial]:
    """At most `count` of them, from as many initialisations and with as many loads as possible."""
    chosen = np.linspace(0, len(trials) - 1, min(count, len(trials))).round().astype(int)
    return [trials[index] for index in chosen]


def _value(contact: ContactModel, unknown: ContactUnknown) -> float:
    return contact.values[unknown.effect.name][unknown.parameter.name]


def _neutral(unknown: ContactUnknown) -> float:
    return float(np.clip(unknown.parameter.neutral, unknown.parameter.low, unknown.parameter.high))


def in_words(estimate: Estimate) -> str:
    """Value and interval for people."""
    unit = "" if estimate.unit == "1" else f" {estimate.unit}"
    return f"{estimate.value:.3g}{unit} [{estimate.low:.3g}, {estimate.high:.3g}]"
