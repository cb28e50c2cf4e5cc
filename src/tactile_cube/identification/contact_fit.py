"""Contact effects from trials with an object: each trial gives a value, their scatter the interval."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from tactile_cube.drivetrain.model_file import Estimate
from tactile_cube.identification.contact_search import TrialEstimate, best_value, first_value
from tactile_cube.identification.contact_trial import ContactTrial
from tactile_cube.identification.contact_unknown import Unknown, unknowns
from tactile_cube.measurement.hand_replay import Contact
from tactile_cube.simulation.contact_effects import ContactEffect

CONFIDENCE = 0.95
SOLVER = 0.03  # relative error of a friction found at 2 ms and 30 iterations, against half the step
# Values are compared at joint offsets that are not at their best for each of them; all initialisations share what that
# does to the spinning friction, so that their scatter does not show it. Seen: 0.017 to 0.024 m for a true 0.03 m.
SHARED = {"spinning_friction": float(np.log(2.0))}


@dataclass(frozen=True)
class ContactFit:
    """What was found.

    Attributes:
        contact: the values.
        estimates: (effect, parameter) -> value with interval.
        opinions: (effect, parameter) -> what each trial said.
    """

    contact: Contact
    estimates: dict[tuple[str, str], Estimate]
    opinions: dict[tuple[str, str], list[TrialEstimate]]

    def silent(self) -> list[str]:
        """Parameters of which no trial knows anything."""
        return [" ".join(key) for key, said in self.opinions.items() if not any(one.telling for one in said)]


def fit_contact(
    trials: Sequence[ContactTrial],
    effects: Sequence[type[ContactEffect]],
    start: Contact,
    say: Callable[[str], None] = print,
) -> ContactFit:
    """Fit the parameters of some effects: all of them coarsely, then each with the others as they were found.

    Args:
        trials: with an object.
        effects: what to fit.
        start: values of all other contact effects.
        say: takes progress lines.
    """
    contact, wanted = start, unknowns(list(effects))
    for one in dict.fromkeys(one for effect in effects for one in shown_by(trials, effect)):
        one.settle(start)
    for unknown in wanted:
        value = first_value(shown_by(trials, unknown.effect), contact, unknown)
        contact = unknown.put(contact, _neutral(unknown) if value is None else value)
    opinions: dict[tuple[str, str], list[TrialEstimate]] = {}
    estimates: dict[tuple[str, str], Estimate] = {}
    for unknown in wanted:
        key = (unknown.effect.name, unknown.parameter.name)
        around = contact.values[key[0]][key[1]]
        opinions[key] = [best_value(one, contact, unknown, around) for one in shown_by(trials, unknown.effect)]
        estimates[key] = summarise(unknown, opinions[key])
        contact = unknown.put(contact, estimates[key].value)
        say(f"{unknown.label}: {in_words(estimates[key])}")
    return ContactFit(contact, estimates, opinions)


def shown_by(trials: Sequence[ContactTrial], effect: type[ContactEffect]) -> list[ContactTrial]:
    """The trials of the kinds that show an effect best, or all where there is none."""
    chosen = [one for one in trials if one.trial.kind in effect.shown_by]
    return chosen or list(trials)


def summarise(unknown: Unknown, opinions: Sequence[TrialEstimate]) -> Estimate:
    """Mean of what the initialisations say, with Student's interval of their scatter.

    Trials of one initialisation share its joint offsets, so they count as one where there are several. Where no trial
    knows anything the value is the neutral one and the interval the whole range.
    """
    parameter = unknown.parameter
    values = _independent([one for one in opinions if one.telling], unknown)
    if not values:
        return Estimate(value=_neutral(unknown), low=parameter.low, high=parameter.high, unit=parameter.unit)
    mean = float(np.mean(values))
    if len(values) == 1:
        grid = np.array([unknown.scaled(float(value)) for value in unknown.grid()])
        half = float(np.diff(grid).mean())
    else:
        scatter = float(np.std(values, ddof=1)) / np.sqrt(len(values))
        half = float(stats.t.ppf((1 + CONFIDENCE) / 2, len(values) - 1)) * scatter
    half = float(np.hypot(half, SHARED.get(unknown.effect.name, SOLVER))) if unknown.by_factors else half
    low, value, high = (unknown.unscaled(mean + side * half) for side in (-1, 0, 1))
    return Estimate(value=value, low=low, high=high, unit=parameter.unit)


def _independent(opinions: Sequence[TrialEstimate], unknown: Unknown) -> list[float]:
    groups: dict[int, list[float]] = {}
    for one in opinions:
        groups.setdefault(one.initialisation, []).append(unknown.scaled(one.value))
    if len(groups) > 1:
        return [float(np.mean(values)) for values in groups.values()]
    return [value for values in groups.values() for value in values]


def _neutral(unknown: Unknown) -> float:
    return float(np.clip(unknown.parameter.neutral, unknown.parameter.low, unknown.parameter.high))


def in_words(estimate: Estimate) -> str:
    """Value and interval for people."""
    unit = "" if estimate.unit == "1" else f" {estimate.unit}"
    return f"{estimate.value:.3g}{unit} [{estimate.low:.3g}, {estimate.high:.3g}]"
