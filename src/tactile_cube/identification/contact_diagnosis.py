"""Which property of fingertips or object a model lacks, judged on trials that the fit never saw."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelErrors, ModelFile
from tactile_cube.identification.contact_fit import evenly, fit_contact, shown_by
from tactile_cube.identification.contact_search import best_of, first_value, narrowed, pooled_cost, surprises
from tactile_cube.identification.contact_together import solved
from tactile_cube.identification.contact_trial import SIGMA, ContactTrial
from tactile_cube.identification.contact_unknown import unknowns
from tactile_cube.identification.in_words import GAIN_OF
from tactile_cube.measurement.bench import with_object
from tactile_cube.measurement.error import ErrorSummary, summarise
from tactile_cube.measurement.hand_replay import Contact, HandReplay, contact_of
from tactile_cube.measurement.noise_floor import sensor_noise
from tactile_cube.measurement.parameters import nominal_parameters
from tactile_cube.measurement.recording import Recording
from tactile_cube.measurement.split import held_out_split
from tactile_cube.simulation.contact_effects import ContactEffect, contact_catalogue

Array = NDArray[np.float64]
Verdict = Literal["adequate", "missing_effect", "ambiguous", "unknown_effect"]
FITTED, JUDGED = 3, 2  # trials of each kind that are fitted and judged
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
    contact: Contact
    error: float
    gain: float
    p_value: float
    gain_of: Literal["error", "offsets"] = "error"


@dataclass(frozen=True)
class ContactDiagnosis:
    """The answer.

    Attributes:
        verdict: the answer.
        found: effects that were added, in that order.
        rivals: what explains the last of them as well.
        tried: everything that was tried, best first in each round.
        estimates: (effect, parameter) -> value with interval.
        stages: nominal and with_effects: held-out errors [rad].
        noise_floor: noise of the position sensors, and what a world with the true effects leaves [rad].
        held_out: names of the trials that judged.
    """

    verdict: Verdict
    found: list[Tried]
    rivals: list[Tried]
    tried: list[list[Tried]]
    estimates: dict[tuple[str, str], Estimate]
    stages: dict[str, ErrorSummary]
    noise_floor: float
    held_out: list[str]

    def effects(self) -> list[EffectEstimate]:
        """The recommended effects as the model file states them."""
        names = [one.effect.name for one in self.found] if self.verdict != "unknown_effect" else []
        grouped = {name: {p: e for (n, p), e in self.estimates.items() if n == name} for name in names}
        return [EffectEstimate(effect=name, parameters=values) for name, values in grouped.items()]

    def into(self, model: ModelFile, alone: bool) -> ModelFile:
        """The model with these effects; `alone`: nothing else was diagnosed, so its errors are these."""
        update: dict[str, Any] = {"effects": [*model.drive_effects, *self.effects()]}
        if alone:
            overall: dict[str, Any] = {key: summary.overall for key, summary in self.stages.items()}
            update["errors"] = ModelErrors(**overall, noise_floor=self.noise_floor)
            others = [name for name in model.provenance.trials if name not in self.held_out]
            trials = {"trials": others, "held_out": self.held_out}
            update["provenance"] = model.provenance.model_copy(update=trials)
        return model.model_copy(update=update)

    def as_json(self) -> dict[str, Any]:
        """In the terms of diagnosis.json; errors in rad."""
        rivals = [one.effect.name for one in self.rivals]
        entries = [self._entry(one, rivals if one is self.found[-1] else []) for one in self.found]
        chosen = [one.effect.name for one in self.found[-1:]]
        entries += [self._entry(one, [*chosen, *(r for r in rivals if r != one.effect.name)]) for one in self.rivals]
        overall = {key: summary.overall for key, summary in self.stages.items()}
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
                for tried in self.tried
                for one in tried
            ],
            # grasps refit no constants of the drives: the stated error stands for the refitted one
            "error": overall | {"refitted": overall["nominal"], "noise_floor": self.noise_floor},
            "error_joints": {key: summary.joints for key, summary in self.stages.items()},
            "noise_floor_source": "contact",
            "unexplained": [],
            "partial_effects": entries if self.verdict == "unknown_effect" else [],
            "next_experiment": None,
            "held_out": self.held_out,
        }

    def _entry(self, one: Tried, rivals: list[str]) -> dict[str, Any]:
        coarse = {p.name: Estimate(value=v, low=p.low, high=p.high, unit=p.unit) for p, v in _values(one)}
        exact = {p: e for (name, p), e in self.estimates.items() if name == one.effect.name}
        return {
            "name": one.effect.name,
            "joints": ["object"],
            "parameters": {key: e.model_dump() for key, e in (coarse | exact).items()},
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
    held = with_object(recording)
    fitted_part, held_out = held_out_split(held, seed=seed)
    replay = HandReplay(held, nominal_parameters(held, model), step)
    try:
        trials = _some_of_each_kind([ContactTrial(replay, trial) for trial in fitted_part.trials], FITTED)
        judges = _some_of_each_kind([ContactTrial(replay, trial) for trial in held_out.trials], JUDGED)
        start = contact_of(model)
        search = ContactSearch(trials, judges, say)
        search.run(start)
        estimates = {}
        if search.found:
            effects = [one.effect for one in search.found]
            fit = fit_contact(trials, effects, start, say)
            estimates, end = fit.estimates, _squares(judges, fit.contact)
        else:
            end = search.first
    finally:
        replay.close()
    stages = {
        key: summarise(list(np.sqrt(s)), held.joints) for key, s in (("nominal", search.first), ("with_effects", end))
    }
    noise = float(np.hypot(np.sqrt(np.mean(sensor_noise(held) ** 2)), SIGMA))
    names = [one.trial.name for one in judges]
    verdict = verdict_of(search, stages["with_effects"].overall)
    return ContactDiagnosis(verdict, search.found, search.rivals, search.tried, estimates, stages, noise, names)


def with_contact(result: Mapping[str, Any], found: ContactDiagnosis) -> dict[str, Any]:
    """The content of diagnosis.json of a drivetrain, with what was found of fingertips and object.

    The errors stay those of free motion; those of the grasps stand under `contact`.
    """
    contact = found.as_json()
    verdicts = (result["verdict"], contact["verdict"])
    return {
        **result,
        "verdict": next(
            one for one in ("unknown_effect", "ambiguous", "missing_effect", "adequate") if one in verdicts
        ),
        "effects": [*result["effects"], *contact["effects"]],
        "partial_effects": [*result["partial_effects"], *contact["partial_effects"]],
        "contact": contact,
    }


class ContactSearch:
    """Effect after effect, each time the one that leaves least of the held-out error.

    Attributes:
        found: effects that were added, in that order.
        rivals: what explains the last of them as well.
        tried: everything that was tried, best first in each round.
        first: mean square of the held-out residual to begin with (trials, 1, joints) [rad^2].
    """

    def __init__(self, trials: Sequence[ContactTrial], judges: Sequence[ContactTrial], say: Callable[[str], None]):
        """Takes the trials to fit, those that judge, and what takes progress lines."""
        self.trials, self.judges, self.say = trials, judges, say
        self.found: list[Tried] = []
        self.rivals: list[Tried] = []
        self.tried: list[list[Tried]] = []

    def run(self, contact: Contact) -> None:
        """Fill `found`, `rivals`, `tried` and `first`."""
        self.say(f"simulating {len(self.trials)} trials as stated, and {len(self.judges)} that judge")
        self.first = before = _squares(self.judges, contact)
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
            contact, before = best.contact, _squares(self.judges, best.contact)

    def _try(self, effect: type[ContactEffect], contact: Contact, before: Array) -> Tried:
        """The effect at the values that suit the trials best, coarse unless they promise something."""
        trials, stated = self._looked_at(effect), contact
        contact = _coarse(effect, trials, stated)
        if pooled_cost(trials, stated, effect) - pooled_cost(trials, contact, effect) < len(trials) * np.log(PROMISE):
            self.say(f"{effect.name}: takes nothing off the error")
            return Tried(effect, contact, float(np.sqrt(before.mean())), 0.0, 1.0)
        after = _squares(self.judges, contact)
        error = float(np.sqrt(after.mean()))
        telling = [one in shown_by(self.judges, effect) for one in self.judges]
        old, new = np.sqrt(before[telling]), np.sqrt(after[telling])
        gain = 1 - float(np.sqrt(np.mean(new**2) / np.mean(old**2)))
        p_value = (
            float(stats.wilcoxon((old - new).ravel(), alternative="greater").pvalue) if np.any(old != new) else 1.0
        )
        found = Tried(effect, contact, error, gain, p_value)
        if effect.shows_in == "offsets":
            offsets = offsets_gained([*trials, *shown_by(self.judges, effect)], stated, contact)
            found = max(found, Tried(effect, contact, error, *offsets, "offsets"), key=lambda one: one.gain)
        self.say(f"{effect.name}: takes {100 * found.gain:.0f} % off {GAIN_OF[found.gain_of]}")
        return found

    def _looked_at(self, effect: type[ContactEffect]) -> list[ContactTrial]:
        """A few trials that show the effect; all of them where the offsets of all initialisations have to tell."""
        trials = shown_by(self.trials, effect)
        return trials if effect.shows_in == "offsets" else _some_of_each_kind(trials, LOOKED)


def _coarse(effect: type[ContactEffect], trials: Sequence[ContactTrial], contact: Contact) -> Contact:
    """The effect roughly at the values that suit the trials best."""
    if effect.shows_in == "load":
        return solved(trials, contact, unknowns([effect]))[0]
    for unknown in unknowns([effect]):
        value = first_value(trials if effect.shows_in == "offsets" else trials[:1], contact, unknown)
        if value is not None:
            contact = unknown.put(contact, value)
            contact = unknown.put(contact, best_of(narrowed(trials, contact, unknown, value, ROUGHLY)))
    return contact


def offsets_gained(trials: Sequence[ContactTrial], before: Contact, after: Contact) -> tuple[float, float]:
    """Share by which an effect makes the joint offsets smaller that trials need, and the p-value that it does not.

    The F test of one more number, which holds whatever the spread of the offsets is. It has trials to fit and held-out
    ones together: a single held-out initialisation may need less offset by chance.
    """
    first, last = (sum(surprises(trials, contact).values()) for contact in (before, after))
    freedom = sum({one.trial.initialisation: one.freedom for one in trials}.values())
    ratio = max(first - last, 0.0) / (last / freedom)
    return 1 - float(np.sqrt(last / first)), float(stats.f.sf(ratio, 1, freedom))


def verdict_of(search: ContactSearch, left: float) -> Verdict:
    """The answer, with `left` of the held-out error [rad]."""
    if not search.found:
        return "adequate" if left < 2 * GOOD else "unknown_effect"
    return "ambiguous" if search.rivals else "missing_effect"


def _squares(trials: Sequence[ContactTrial], contact: Contact) -> Array:
    """Mean square of the residual (trials, 1, joints) [rad^2], offsets and the box's place fitted."""
    rows = []
    for one in trials:
        rows.append([np.mean(one.residual(contact)[one.trial.valid] ** 2, axis=0)])
    return np.array(rows)


def _some_of_each_kind(trials: Sequence[ContactTrial], count: int) -> list[ContactTrial]:
    """At most `count` trials of each kind."""
    kinds: dict[str, list[ContactTrial]] = {}
    for one in trials:
        kinds.setdefault(one.trial.kind, []).append(one)
    return [one for members in kinds.values() for one in evenly(members, count)]


def _values(one: Tried) -> list[tuple[Any, float]]:
    values: Mapping[str, float] = one.contact.values.get(one.effect.name, {})
    pairs = [(p, values.get(p.name, p.neutral)) for p in one.effect.parameters]
    return [(p, float(np.clip(value, p.low, p.high))) for p, value in pairs]
