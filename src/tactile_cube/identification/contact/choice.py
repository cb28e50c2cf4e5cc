"""Which effects of fingertips and object help, one after another, judged on trials that the fit never saw."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tactile_cube.identification.contact.fit import evenly, shown_by
from tactile_cube.identification.contact.search import (
    best_of,
    contact_unknowns,
    first_value,
    narrowed,
    pooled_cost,
    prior_penalties,
    solved,
)
from tactile_cube.identification.contact.trial import ContactTrial
from tactile_cube.identification.in_words import GAIN_OF
from tactile_cube.measurement.replay.hand_replay import ContactModel
from tactile_cube.simulation.contact_effects import ContactEffect, contact_catalogue

Array = NDArray[np.float64]
LOOKED = 2  # of those that are fitted, how many decide whether an effect helps
ROUGHLY = 2  # times that the grid is halved for that
PROMISE = 1.1  # factor by which an effect must lower the cost of those to be judged
GAIN = 0.15  # least share of the held-out error that an effect must take off
AS_GOOD = 0.1  # an effect that leaves at most this share more is a rival
P_VALUE = 0.01
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
    first, last = (sum(prior_penalties(trials, contact).values()) for contact in (before, after))
    freedom = sum({one.trial.initialisation: one.freedom for one in trials}.values())
    ratio = max(first - last, 0.0) / (last / freedom)
    return 1 - float(np.sqrt(last / first)), float(stats.f.sf(ratio, 1, freedom))


def mean_squares(trials: Sequence[ContactTrial], contact: ContactModel) -> Array:
    """Mean square of the residual (trials, 1, joints) [rad^2], offsets and the box's place fitted."""
    rows = []
    for one in trials:
        rows.append([np.mean(one.residual(contact)[one.trial.valid] ** 2, axis=0)])
    return np.array(rows)


def some_of_each_kind(trials: Sequence[ContactTrial], count: int) -> list[ContactTrial]:
    """At most `count` trials of each kind."""
    kinds: dict[str, list[ContactTrial]] = {}
    for one in trials:
        kinds.setdefault(one.trial.kind, []).append(one)
    return [one for members in kinds.values() for one in evenly(members, count)]
