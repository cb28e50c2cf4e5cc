"""Effects of fingertips and object: fit those that a user names, and search for those that a model lacks."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from tactile_cube.drivetrain.effects.effect import FINGER
from tactile_cube.drivetrain.model_file import EffectEstimate, ModelErrors, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.identification.contact.grasps import (
    FITTED,
    JUDGED,
    OBJECT,
    Grasps,
    OpenGrasps,
    open_grasps,
    some_of_each_kind,
)
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.diagnosis_json import effect_entries, names_of, ranking
from tactile_cube.identification.fitting.gauss_newton import Fit, fit, precision
from tactile_cube.identification.fitting.resolution import Fitted, bounds, standard_errors
from tactile_cube.identification.model_files import effect_estimate
from tactile_cube.identification.search.candidates import Candidate, model_unknowns, without_effect
from tactile_cube.identification.search.evidence import gain, p_value, worse
from tactile_cube.identification.search.explanation import Explanation, Proposal, named_by
from tactile_cube.identification.search.findings import Findings
from tactile_cube.identification.search.proposals import CLOSE
from tactile_cube.identification.verdict import Kind, Verdict, decide, unexplained_joints
from tactile_cube.measurement.bench import with_object
from tactile_cube.measurement.comparing.error import ErrorSummary
from tactile_cube.measurement.recordings.reading import DESCRIPTION
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model
from tactile_cube.simulation.contact_effects import ContactEffect, contact_catalogue, is_contact_effect

Say = Callable[[str], None]
LOOKED = 1  # trials of each kind on which every law gets its first step
STEPS, LAST_STEPS = 3, 2  # of Gauss-Newton, of a set in a search and of the last fit
FINER = 2  # trials of each kind that tell what shorter steps of the world change
SINGLES, MOST = 3, 3  # laws of each round that are refitted on more trials; effects of a set
SURER: tuple[Kind, ...] = ("unknown_effect", "partly_explained", "ambiguous", "missing_effect", "adequate")
"""Verdicts, least certain first."""


def stepped(problem: Grasps, parent: Model, effect: type[ContactEffect]) -> tuple[Candidate, Fit]:
    """Add an effect to a contact at its best start and fit its parameters by one Gauss-Newton step."""
    found = []
    for form in effect.starts_at(FINGER):
        candidate = Candidate(effect, (OBJECT,), form)
        model, unknowns = candidate.added_to(parent)
        found.append((problem.squares(model), candidate, model, unknowns))
    _, candidate, model, unknowns = min(found, key=lambda one: one[0])
    return candidate, fit(problem, model, unknowns, iterations=1)


def final(grasps: OpenGrasps, model: Model) -> Fitted:
    """Refit a contact on all fitted trials, with intervals; keep its values if held-out trials are predicted worse."""
    problem = grasps.fitted
    problem.linearise_starts(model)
    fitted = fit(problem, model, model_unknowns(model), LAST_STEPS)
    if worse(grasps.held_out.judged(fitted.model), grasps.held_out.judged(model)):
        fitted = fit(problem, model, model_unknowns(model), iterations=0)
    if not fitted.unknowns:
        return Fitted(fitted.model, fitted, np.zeros(0), np.zeros(0))
    scales = np.array([u.scale for u in fitted.unknowns])
    few = some_of_each_kind(problem, FINER)
    base, columns = few.columns(fitted.model, fitted.unknowns)
    moved = few.limited(grasps.finer(few).prediction(fitted.model) - base) * few.weight
    pull, information = columns.reshape(-1, len(scales)).T @ moved.ravel(), np.einsum("grp,grq->pq", columns, columns)
    shift = -scales * np.linalg.solve(information + np.diag(precision(fitted.unknowns)), pull)
    student = stats.t.ppf(0.975, max(len(set(problem.alike)) - 1, 1))  # each initialisation has errors of its own
    return Fitted(fitted.model, fitted, student * scales * standard_errors(problem, fitted), shift)


@dataclass(frozen=True)
class ContactIdentification:
    """Contact effects with intervals, and what they gain.

    Attributes:
        fitted: values and intervals.
        stages: nominal and with_effects: errors on held-out trials, offsets and the box's place fitted to each [rad].
        noise_floor: noise of the position sensors, and what a world with the true effects leaves [rad].
        held_out: names of the held-out trials.
    """

    fitted: Fitted
    stages: dict[str, ErrorSummary]
    noise_floor: float
    held_out: list[str]

    def into(self, model: ModelFile, alone: bool) -> ModelFile:
        """Return the model file with these effects; `alone`: nothing else was identified, so its errors are these."""
        effects = model.with_effects(self.effects())
        if not alone:
            return model.model_copy(update={"effects": effects})
        errors = ModelErrors(**self.errors, joints=self.joint_errors)
        fitted = [name for name in model.provenance.trials if name not in self.held_out]
        provenance = model.provenance.model_copy(update={"trials": fitted, "held_out": self.held_out})
        return model.model_copy(update={"effects": effects, "errors": errors, "provenance": provenance})

    @property
    def errors(self) -> dict[str, float]:
        """The error of each stage, and the noise floor [rad]."""
        return {key: one.overall for key, one in self.stages.items()} | {"noise_floor": self.noise_floor}

    @property
    def joint_errors(self) -> dict[str, dict[str, float]]:
        """Stage -> joint -> error [rad]."""
        return {key: one.joints for key, one in self.stages.items()}

    def effects(self) -> list[EffectEstimate]:
        """Return the estimates of the fitted effects for the model file."""
        known = bounds(self.fitted)
        return [
            effect_estimate(term, place, known) for place, term in enumerate(self.fitted.model.terms) if term.fitted
        ]

    @property
    def silent(self) -> list[str]:
        """Parameters that are not identifiable: any allowed value fits the trials."""
        terms, known = self.fitted.model.terms, bounds(self.fitted)
        return [
            f"{terms[u.place].effect.name} {u.key}"
            for u in self.fitted.fit.unknowns
            if known[u.kind, u.key, u.place, u.initialisation][1:] == (u.low, u.high)
        ]

    def as_json(self) -> dict[str, Any]:
        """Return plain numbers, errors in rad."""
        return {
            "effects": [one.model_dump() for one in self.effects()],
            "error": self.errors,
            "joints": self.joint_errors,
            "held_out": self.held_out,
            "silent": self.silent,
        }


def contact_effects(names: Sequence[str], recording: Recording) -> list[type[ContactEffect]]:
    """Return the contact effects among the names of effects that a user gives.

    Raises:
        InputError: a contact effect with a joint, or with a recording that has no object.
    """
    chosen = [name for name in names if is_contact_effect(name)]
    for name in chosen:
        if "@" in name:
            raise InputError(
                f"effects: '{name}': {name.partition('@')[0]} belongs to fingertips and object, not to a joint; "
                "leave out what follows the @"
            )
        if not with_object(recording).trials:
            raise InputError(
                f"effects: '{name}' shows only where the hand holds something, and no trial of "
                f"{recording.folder / DESCRIPTION} has a key 'object'; record such trials "
                "(python -m tactile_cube.record source=grasp simulates them) or leave the effect out"
            )
    return [contact_catalogue()[name] for name in dict.fromkeys(chosen)]


def identify_contact(
    recording: Recording,
    effects: Sequence[type[ContactEffect]],
    model: ModelFile | None = None,
    step: float = 0.002,
    seed: int = 0,
    say: Say = print,
) -> ContactIdentification:
    """Fit contact effects by simulation in the world that training uses, the drivetrain taken as known.

    Args:
        recording: trials without an object are left aside.
        effects: what to fit.
        model: of the drivetrain; None: as recording.yaml states it.
        step: longest physics step [s].
        seed: which trials are held out.
        say: takes progress lines.
    """
    with open_grasps(recording, model, step, seed) as grasps:
        few, found = some_of_each_kind(grasps.fitted, LOOKED), grasps.without(effects)
        few.linearise_starts(found)
        for effect in effects:
            found = stepped(few, found, effect)[1].model
            say(f"{effect.name}: {_values(found.terms[-1].values)}")
        fitted = final(grasps, found)
        say("simulating the held-out trials")
        stages = {"nominal": grasps.start, "with_effects": fitted.model}
        errors = {key: grasps.held_out.errors(one, recording.joints) for key, one in stages.items()}
        held_out = [one.trial.name for one in grasps.held_out.grasps]
    return ContactIdentification(fitted, errors, grasps.noise_floor, held_out)


def _values(values: Mapping[str, float]) -> str:
    return ", ".join(f"{key} {value:.3g}" for key, value in values.items())


class ContactSearch:
    """Search for missing contact effects: single laws, growing sets, the best judged on held-out trials."""

    def __init__(self, grasps: OpenGrasps, criteria: Criteria, say: Say) -> None:
        """Simulate the contact as it is stated."""
        self.criteria, self.say = criteria, say
        self.few, self.problem = (some_of_each_kind(grasps.fitted, count) for count in (LOOKED, FITTED))
        self.validation = some_of_each_kind(grasps.held_out, JUDGED)
        say(f"simulating {len(self.problem.grasps)} trials as stated, and {len(self.validation.grasps)} that validate")
        for problem in (self.few, self.problem):
            problem.linearise_starts(grasps.start)
        start = fit(self.problem, grasps.start, (), iterations=0)
        self.base = Explanation((), start, self.validation.judged(grasps.start), 1.0, 0.0)

    def find(self) -> Findings:
        """Return all proposed sets, judged on held-out trials; every law of the catalogue counts as tested."""
        judged = tuple(self.explained(one) for one in self.proposed())
        return Findings(self.base, self.base.judgement, judged, looked=len(contact_catalogue()))

    def proposed(self) -> list[Proposal]:
        """Propose sets of effects by their fit alone: forward selection, then the selected set without each effect."""
        parent, found = Proposal((), self.base.fit), dict[frozenset[tuple[str, str]], Proposal]()
        most = self.criteria.floor
        while len(parent.effects) < MOST and self.problem.judged(parent.fit.model).joint_errors.max() > most:
            most = self.criteria.adequate  # the true effects leave as much: no reason for one more
            grown = sorted(self.grown(parent), key=lambda one: one.price(self.criteria))
            found |= {named_by(one.effects): one for one in grown}
            if not grown or grown[0].price(self.criteria) >= parent.price(self.criteria):
                break
            parent = grown[0]
        for place in range(len(parent.effects)) if len(parent.effects) > 1 else ():
            effects = (*parent.effects[:place], *parent.effects[place + 1 :])
            if named_by(effects) not in found:
                model = without_effect(parent.fit.model, parent.effects, place)
                found[named_by(effects)] = self.refitted(effects, model)
        return list(found.values())

    def grown(self, parent: Proposal) -> list[Proposal]:
        """Refit the parent with one more law, for each of the laws whose own step reduces the cost most."""
        known = {term.effect for term in parent.fit.model.terms}
        left = [effect for effect in contact_catalogue().values() if effect not in known]
        laws = sorted((stepped(self.few, parent.fit.model, effect) for effect in left), key=lambda one: one[1].cost)
        worth = (1.0 - self.criteria.least_gain) * self.few.squares(parent.fit.model)
        worth = min(worth, CLOSE * laws[0][1].cost)
        laws = [one for one in laws if one[1].cost < worth][:SINGLES]
        return [self.refitted((*parent.effects, law), fitted.model) for law, fitted in laws]

    def refitted(self, effects: tuple[Candidate, ...], model: Model) -> Proposal:
        """Refit a set of effects with all parameters free."""
        one = Proposal(effects, fit(self.problem, model, model_unknowns(model), STEPS))
        left = np.sqrt(one.fit.cost / self.base.fit.cost)
        said = (f"{term.effect.name} {_values(term.values)}" for term in one.fit.model.terms if term.fitted)
        self.say(f"  leaves {100 * left:.0f} % of the error: {' & '.join(said)}")
        return one

    def explained(self, one: Proposal) -> Explanation:
        """Judge a fitted set on the held-out trials."""
        judged = self.validation.judged(one.fit.model)
        chance = min(1.0, p_value(self.base.judgement, judged) * len(contact_catalogue()))
        return Explanation(one.effects, one.fit, judged, chance, gain(self.base.judgement, judged))


@dataclass(frozen=True)
class ContactDiagnosis(ContactIdentification):
    """The answer, and the effects that were found with their intervals.

    Attributes:
        answer: the answer.
        findings: what was tried.
        rivals: what explains the grasps as well, with intervals.
        unexplained: joints of which more is left than is tolerated.
        criteria: what decided.
    """

    answer: Verdict
    findings: Findings
    rivals: tuple[tuple[Explanation, Fitted], ...]
    unexplained: list[str]
    criteria: Criteria

    @property
    def verdict(self) -> Kind:
        """Verdict, as in diagnosis.json."""
        return self.answer.kind

    def as_json(self) -> dict[str, Any]:
        """Return the diagnosis in the terms of diagnosis.json; errors in rad."""
        explanations = [(self.answer.chosen, self.fitted), *self.rivals]
        entries, unknown = effect_entries(explanations), self.verdict == "unknown_effect"
        return {
            "verdict": self.verdict,
            "effects": [] if unknown else entries,
            "sets": [names_of(one) for one, _ in explanations] if self.rivals else [],
            "unexplained_joints": self.unexplained,
            "ranking": ranking(self.findings, self.criteria),
            # grasps refit no constants of the drives: the stated error stands for the refitted one
            "error": self.errors | {"refitted": self.errors["nominal"]},
            "error_joints": self.joint_errors,
            "noise_floor_source": "contact",
            "unexplained": [],
            "partial_effects": entries if unknown else [],
            "next_experiment": None,
            "held_out": self.held_out,
        }


def diagnose_contact(
    recording: Recording,
    model: ModelFile | None = None,
    step: float = 0.002,
    seed: int = 0,
    say: Say = print,
    criteria: Criteria = STANDARD,
) -> ContactDiagnosis:
    """Find out by some criteria which contact effect a model lacks; arguments as in `identify_contact`."""
    with open_grasps(recording, model, step, seed) as grasps:
        return diagnosed(grasps, recording.joints, criteria, say)


def diagnosed(grasps: OpenGrasps, joints: Sequence[str], criteria: Criteria, say: Say) -> ContactDiagnosis:
    """Diagnose grasps simulated by any world, as `diagnose_contact` does."""
    search = ContactSearch(grasps, criteria, say)
    findings = search.find()
    answer = decide(findings, criteria)
    say(f"verdict {answer.kind}: {answer.chosen.label}")
    fitted = final(grasps, answer.chosen.fit.model)
    rivals = tuple((one, final(grasps, one.fit.model)) for one in answer.rivals)
    stages = {"nominal": grasps.start, "with_effects": fitted.model}
    errors = {key: search.validation.errors(one, joints) for key, one in stages.items()}
    held_out = [one.trial.name for one in search.validation.grasps]
    left = unexplained_joints(answer.chosen, (*joints, "joint offsets"), criteria)
    return ContactDiagnosis(fitted, errors, grasps.noise_floor, held_out, answer, findings, rivals, left, criteria)


def with_contact(result: Mapping[str, Any], found: ContactDiagnosis) -> dict[str, Any]:
    """Return the content of diagnosis.json of a drivetrain with the diagnosis of fingertips and object added.

    The errors remain those of free motion; those of the grasps are under `contact`.
    """
    contact = found.as_json()
    return {
        **result,
        "verdict": min(result["verdict"], contact["verdict"], key=SURER.index),
        "effects": [*result["effects"], *contact["effects"]],
        "partial_effects": [*result["partial_effects"], *contact["partial_effects"]],
        "contact": contact,
    }
