"""Which property of fingertips or object a model lacks, judged on trials that the fit never saw."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.identification.contact.fit import (
    ContactFit,
    best_of,
    contact_unknowns,
    evenly,
    first_value,
    fit_contact,
    grouped,
    narrowed,
    offset_penalty,
    pooled_cost,
    shown_by,
    solved,
)
from tactile_cube.identification.contact.identification import ContactIdentification
from tactile_cube.identification.contact.trial import ContactTrial, open_grasps
from tactile_cube.identification.in_words import GAIN_OF
from tactile_cube.identification.verdict import Kind
from tactile_cube.measurement.comparing.error import summarise_errors
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.hand_replay import ContactModel
from tactile_cube.simulation.contact_effects import ContactEffect, contact_catalogue

Array = NDArray[np.float64]
SURER: tuple[Kind, ...] = ("unknown_effect", "partly_explained", "ambiguous", "missing_effect", "adequate")
"""Verdicts, the one that leaves most open first."""
FITTED, JUDGED = 3, 2  # trials of each kind that are fitted and judged
LOOKED = 2  # of those that are fitted, how many decide whether an effect helps
ROUGHLY = 2  # times that the grid is halved for that
PROMISE = 1.1  # factor by which an effect must lower the cost of those to be judged
GAIN = 0.1  # least share of the held-out error that an effect must take off, or of the offsets
AS_GOOD = 0.1  # an effect that leaves at most this share more is a rival
P_VALUE = 0.05  # of a gain that is worth a fit of all initialisations, which decides
GOOD = 2e-3  # [rad] a grasp is followed no better, with drives known to 10 % and a solver that stops early
MOST_EFFECTS = 3


@dataclass(frozen=True)
class Tried:
    """An effect with coarse values, and the held-out error that it leaves.

    Attributes:
        effect: class of the effect.
        contact: values, those of effects found before included.
        error: RMS on held-out trials [rad].
        gain: share of the error of the trials that show it that it takes off, or of the joint offsets that they need,
            whichever is larger.
        p_value: that it takes off nothing.
        gain_of: which of these.
    """

    effect: type[ContactEffect]
    contact: ContactModel
    error: float
    gain: float
    p_value: float
    gain_of: Literal["error", "offsets"] = "error"


class ContactSearch:
    """Effect after effect, each time the one that leaves least of the held-out error.

    Attributes:
        found: effects that were added, in that order.
        rivals: what explains the last of them as well.
        tried: everything that was tried, best first in each round.
        first: mean square of the held-out residual to begin with (trials, 1, joints) [rad^2].
    """

    def __init__(self, trials: Sequence[ContactTrial], validation: Sequence[ContactTrial], say: Callable[[str], None]):
        """Takes the trials to fit, those that judge, and what takes progress lines."""
        self.trials, self.validation, self.say = trials, validation, say
        self.found: list[Tried] = []
        self.rivals: list[Tried] = []
        self.tried: list[list[Tried]] = []

    def run(self, contact: ContactModel) -> None:
        """Fill `found`, `rivals`, `tried` and `first`."""
        self.say(f"simulating {len(self.trials)} trials as stated, and {len(self.validation)} that validate")
        self.first = before = mean_squares(self.validation, contact)
        while len(self.found) < MOST_EFFECTS and (not self.found or np.sqrt(before.mean()) > GOOD):
            known = {one.effect for one in self.found}
            left = [effect for effect in contact_catalogue().values() if effect not in known]
            tried = sorted((self._try(effect, contact, before) for effect in left), key=lambda one: one.error)
            self.tried.append(tried)
            helps = [one for one in tried if one.gain >= GAIN]
            # offsets that are alike for another reason are no rival of an effect that lowers the error
            helps = [one for one in helps if one.gain_of == "error"] or helps
            if not helps or helps[0].p_value > (P_VALUE / len(tried) if helps[0].gain_of == "offsets" else P_VALUE):
                return
            best = helps[0]
            self.found.append(best)
            self.rivals = [one for one in helps[1:] if one.error < (1 + AS_GOOD) * best.error]
            contact, before = best.contact, mean_squares(self.validation, best.contact)

    def prove(self, start: ContactModel) -> ContactFit:
        """Fit what was found to all initialisations and keep what they agree on."""
        while self.found:
            fit = fit_contact(self.trials, [one.effect for one in self.found], start, self.say)
            kept = [one for one in self.found if fit.shows(one.effect, start)]
            if kept == self.found:
                return fit
            for one in self.found:
                if one not in kept:
                    self.say(f"{one.effect.name}: the initialisations do not agree that there is any")
            self.rivals = self.rivals if kept[-1:] == self.found[-1:] else []
            self.found = kept
        return ContactFit(start, {}, {})

    def verdict(self, left: float) -> Kind:
        """The answer, with `left` of the held-out error [rad]."""
        if not self.found:
            return "adequate" if left < GOOD else "unknown_effect"
        return "ambiguous" if self.rivals else "missing_effect"

    def _try(self, effect: type[ContactEffect], contact: ContactModel, before: Array) -> Tried:
        """The effect at the values that suit the trials best, coarse unless they promise something."""
        trials, stated = self._looked_at(effect), contact
        contact = _coarse(effect, trials, stated)
        if pooled_cost(trials, stated, effect) - pooled_cost(trials, contact, effect) < len(trials) * np.log(PROMISE):
            self.say(f"{effect.name}: takes nothing off the error")
            return Tried(effect, contact, float(np.sqrt(before.mean())), 0.0, 1.0)
        after = mean_squares(self.validation, contact)
        error = float(np.sqrt(after.mean()))
        telling = [one in shown_by(self.validation, effect) for one in self.validation]
        old, new = np.sqrt(before[telling]), np.sqrt(after[telling])
        gain = 1 - float(np.sqrt(np.mean(new**2) / np.mean(old**2)))
        p_value = (
            float(stats.wilcoxon((old - new).ravel(), alternative="greater").pvalue) if np.any(old != new) else 1.0
        )
        found = Tried(effect, contact, error, gain, p_value)
        if effect.shows_in == "offsets":
            offsets = offsets_gained([*trials, *shown_by(self.validation, effect)], stated, contact)
            found = max(found, Tried(effect, contact, error, *offsets, "offsets"), key=lambda one: one.gain)
        self.say(f"{effect.name}: takes {100 * found.gain:.0f} % off {GAIN_OF[found.gain_of]}")
        return found

    def _looked_at(self, effect: type[ContactEffect]) -> list[ContactTrial]:
        """A few trials that show the effect; all of them where the offsets of all initialisations have to tell."""
        trials = shown_by(self.trials, effect)
        return trials if effect.shows_in == "offsets" else some_of_each_kind(trials, LOOKED)


def _coarse(effect: type[ContactEffect], trials: Sequence[ContactTrial], contact: ContactModel) -> ContactModel:
    """The effect roughly at the values that suit the trials best."""
    if effect.shows_in == "load":
        return solved(trials, contact, contact_unknowns([effect]))[0]
    for unknown in contact_unknowns([effect]):
        value = first_value(trials if effect.shows_in == "offsets" else trials[:1], contact, unknown)
        if value is not None:
            contact = unknown.put(contact, value)
            contact = unknown.put(contact, best_of(narrowed(trials, contact, unknown, value, ROUGHLY)))
    return contact


def offsets_gained(trials: Sequence[ContactTrial], before: ContactModel, after: ContactModel) -> tuple[float, float]:
    """Share by which an effect makes the joint offsets smaller that trials need, and the p-value that it does not.

    The F test of one more number, which holds whatever the spread of the offsets is. It has trials to fit and held-out
    ones together: a single held-out initialisation may need less offset by chance.
    """
    first, last = (offset_penalty(trials, contact) for contact in (before, after))
    freedom = sum({one.trial.initialisation: one.freedom for one in trials}.values())
    ratio = max(first - last, 0.0) / (last / freedom)
    return 1 - float(np.sqrt(last / first)), float(stats.f.sf(ratio, 1, freedom))


def mean_squares(trials: Sequence[ContactTrial], contact: ContactModel) -> Array:
    """Mean square of the residual (trials, 1, joints) [rad^2], offsets and the box's place fitted."""
    return np.array([[np.mean(one.residual(contact)[one.trial.valid] ** 2, axis=0)] for one in trials])


def some_of_each_kind(trials: Sequence[ContactTrial], count: int) -> list[ContactTrial]:
    """At most `count` trials of each kind."""
    return [one for members in grouped(trials, "kind") for one in evenly(members, count)]


@dataclass(frozen=True)
class ContactDiagnosis(ContactIdentification):
    """The answer, and the effects that were found with their intervals.

    Attributes:
        search: what was tried.
    """

    search: ContactSearch

    @property
    def verdict(self) -> Kind:
        """The answer."""
        return self.search.verdict(self.stages["with_effects"].overall)

    def effects(self) -> list[EffectEstimate]:
        """The recommended effects as the model file states them."""
        return super().effects() if self.verdict != "unknown_effect" else []

    def as_json(self) -> dict[str, Any]:
        """In the terms of diagnosis.json; errors in rad."""
        found, also = self.search.found, [one.effect.name for one in self.search.rivals]
        last = [one.effect.name for one in found[-1:]]
        entries = [self._entry(one, also if one is found[-1] else []) for one in found]
        entries += [
            self._entry(one, [*last, *(name for name in also if name != one.effect.name)]) for one in self.search.rivals
        ]
        return {
            "verdict": self.verdict,
            "effects": entries if self.verdict in ("missing_effect", "ambiguous") else [],
            "unexplained_joints": [],
            "ranking": [
                {
                    "effects": one.effect.name,
                    "held_out_error": one.error,
                    "gain": one.gain,
                    "p_value": one.p_value,
                    "gain_of": one.gain_of,
                }
                for tried in self.search.tried
                for one in tried
            ],
            # grasps refit no constants of the drives: the stated error stands for the refitted one
            "error": self.errors | {"refitted": self.errors["nominal"]},
            "error_joints": {key: summary.joints for key, summary in self.stages.items()},
            "noise_floor_source": "contact",
            "unexplained": [],
            "partial_effects": entries if self.verdict == "unknown_effect" else [],
            "next_experiment": None,
            "held_out": self.held_out,
        }

    def _entry(self, one: Tried, rivals: list[str]) -> dict[str, Any]:
        parameters = {}
        for unknown in contact_unknowns([one.effect]):
            p = unknown.parameter
            value = float(np.clip(unknown.of(one.contact), p.low, p.high))
            coarse = Estimate(value=value, low=p.low, high=p.high, unit=p.unit)
            parameters[p.name] = self.fit.estimates.get((one.effect.name, p.name), coarse).model_dump()
        return {
            "name": one.effect.name,
            "joints": ["object"],
            "parameters": parameters,
            "heldout_gain": one.gain,
            "gain_of": one.gain_of,
            "p_value": one.p_value,
            "rivals": rivals,
        }


def diagnose_contact(
    recording: Recording,
    model: ModelFile | None = None,
    step: float = 0.002,
    seed: int = 0,
    say: Callable[[str], None] = print,
) -> ContactDiagnosis:
    """Add contact effects one after another while the held-out error falls, the drivetrain taken as known.

    Args:
        recording: trials without an object are left aside.
        model: of the drivetrain; None: as recording.yaml states it.
        step: longest physics step [s].
        seed: which trials are held out.
        say: takes progress lines.
    """
    with open_grasps(recording, model, step, seed) as grasps:
        trials = some_of_each_kind(grasps.fitted, FITTED)
        validation = some_of_each_kind(grasps.held_out, JUDGED)
        search = ContactSearch(trials, validation, say)
        search.run(grasps.start)
        fit = search.prove(grasps.start)
        end = mean_squares(validation, fit.contact)
    errors = {"nominal": search.first, "with_effects": end}
    stages = {key: summarise_errors(list(np.sqrt(squares)), grasps.joints) for key, squares in errors.items()}
    return ContactDiagnosis(fit, stages, grasps.noise_floor, [one.trial.name for one in validation], search)


def with_contact(result: Mapping[str, Any], found: ContactDiagnosis) -> dict[str, Any]:
    """The content of diagnosis.json of a drivetrain, with what was found of fingertips and object.

    The errors stay those of free motion; those of the grasps stand under `contact`.
    """
    contact = found.as_json()
    return {
        **result,
        "verdict": min(result["verdict"], contact["verdict"], key=SURER.index),
        "effects": [*result["effects"], *contact["effects"]],
        "partial_effects": [*result["partial_effects"], *contact["partial_effects"]],
        "contact": contact,
    }
