"""A diagnosis from beginning to end: split, search, decide, refit, test, propose the next experiment."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from tactile_cube.drivetrain.effects.effect import Effect, Scales
from tactile_cube.drivetrain.model_file import ModelErrors, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.disturbances import Disturbance, disturbances, in_time, undisturbed
from tactile_cube.identification.fitting.gauss_newton import Fit, fit
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.resolution import Fitted, needless, resolved
from tactile_cube.identification.next_experiment import Experiment, next_experiment
from tactile_cube.identification.search.candidates import first_term
from tactile_cube.identification.search.evidence import HeldOut, as_good, gain, judge
from tactile_cube.identification.search.explanation import Explanation, Proposal, complete, named_by
from tactile_cube.identification.search.findings import CommonOffset, Findings, common_offsets, find, reached
from tactile_cube.identification.search.proposals import MORE_STEPS, refit, stepped, without
from tactile_cube.identification.search.search import BestSoFar, Search
from tactile_cube.identification.standard_model import StandardModel, fit_standard_model
from tactile_cube.identification.verdict import Simulations, Unexplained, Verdict, decide
from tactile_cube.measurement.comparing.error import ErrorSummary, free_run_error
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor, noise_floor, noise_with_links
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, effect_path, nominal_model
from tactile_cube.measurement.replay.simulator import free_run
from tactile_cube.measurement.replay.windows import steps_per_row
from tactile_cube.measurement.split import held_out_split, with_test_part
from tactile_cube.measurement.units import common_unit

MOST_INTERVALS = 12  # maximum number of disturbed intervals; each search for more of them repeats the whole diagnosis
NOT_ALL = ("unknown_effect", "partly_explained")  # verdicts that say that more is missing than is named
LESS = (*NOT_ALL, "ambiguous")  # verdicts that do not name everything that is missing, the least informative first
ALL = (len(LESS), True)  # rank of an answer that names everything and leaves little error, see `Answer.says`


class Answer(NamedTuple):
    """A verdict and what it came from."""

    search: Search
    findings: Findings
    simulations: Simulations
    verdict: Verdict

    @property
    def says(self) -> tuple[int, bool]:
        """Rank of the answer: how completely it names what is missing, then whether little error is left."""
        little_left = self.verdict.chosen.largest_error <= self.search.criteria.tolerated
        return (LESS.index(self.verdict.kind) if self.verdict.kind in LESS else len(LESS)), little_left


@dataclass(frozen=True)
class Inquiry:
    """Diagnosis of a recording under some settings.

    Attributes:
        recording: two or more trials.
        effects: the catalogue to search.
        seed: which trials are held out, and which test.
        say: takes progress lines.
        known: the model to begin with; None: what the recording's owner states.
        criteria: what decides.
        standard: the field's standard model as a set of effects, one of those to be judged; None where it is no better.
    """

    recording: Recording
    effects: Sequence[type[Effect]]
    seed: int
    say: Callable[[str], None]
    known: ModelFile | None
    criteria: Criteria
    standard: Proposal | None = None

    @cached_property
    def parts(self) -> tuple[Recording, Recording, Recording | None]:
        """Training, validation and test trials; test trials only if there are enough."""
        fitted, held_out = held_out_split(self.recording, seed=self.seed)
        fitted, tested = with_test_part(fitted, len(self.recording.trials), self.seed)
        return fitted, held_out, tested

    @cached_property
    def search(self) -> Search:
        """The search on the split trials."""
        fitted, held_out, _ = self.parts
        asked = (self.effects, self.say, self.known, self.criteria)
        return Search(fitted, held_out, noise_with_links(self.recording), *asked)

    @cached_property
    def answer(self) -> Answer:
        """The result of the search."""
        search = self.search
        findings = find(search, self.standard)
        simulations = Simulations(search, findings.base, noise_floor(self.recording))
        return Answer(search, findings, simulations, decide(findings, self.criteria))


class Inquired(NamedTuple):
    """The final inquiry; the excluded and the suspected intervals."""

    inquiry: Inquiry
    left_out: tuple[Disturbance, ...] = ()
    suspected: tuple[Disturbance, ...] = ()


def beside_disturbances(inquiry: Inquiry) -> Inquired:
    """Repeat the diagnosis without the intervals that follow no model, as when somebody pushes the arm.

    An interval is left out where other runs of its command do not fail at that time. Most show already beside the
    model with refitted constants. A failure of a command that ran only once may also be a law that acts nowhere else.
    It is left out only if the answer then names everything that is missing.
    """
    left_out: tuple[Disturbance, ...] = ()
    while len(left_out) < MOST_INTERVALS:
        recording = inquiry.recording
        found = [one for one in disturbances(inquiry.search, recording, inquiry.search.base.fit.model) if one.repeats]
        if not found:
            answer = inquiry.answer
            found = disturbances(answer.search, recording, answer.simulations.final(answer.verdict.chosen).model)
            found = [one for one in found if one.repeats] or found
        proven = any(one.repeats for one in found)
        if not found or (not proven and inquiry.answer.says == ALL):
            break
        for one in found:
            inquiry.say(
                f"{one.trial} follows no model from {one.start:.2f} to {one.end:.2f} s ({one.joint}: {one.error:.0f} x "
                "sensor noise): excluded; repeating the search"
            )
        without = replace(inquiry, recording=undisturbed(recording, found))
        if not proven and without.answer.says <= inquiry.answer.says:
            return Inquired(inquiry, left_out, tuple(found))
        inquiry, left_out = without, (*left_out, *found)
    return Inquired(inquiry, left_out)


UNPROVEN = 3
MOST_STEPS = 1000  # simulation steps a row: more are a sign of a wrong inertia, and would take days
Say = Callable[[str], None]


@dataclass(frozen=True)
class Diagnosis:
    """The answer and everything that supports it.

    Attributes:
        verdict: the answer.
        findings: what was tried.
        fitted: the recommended model, refitted on all fitted trials, with intervals.
        rivals: the same for each rival.
        stages: nominal, refitted, with_effects: free-running errors on the trials that test.
        over_noise: refitted, with_effects: errors of segments there, in units of the sensor noise.
        floor: noise floor of the recording.
        unexplained: what is left, joint by joint; empty unless something is.
        standard: the field's standard model, which came first.
        experiment: what would separate the rivals, or an unproven effect from chance; None without either.
        held_out: names of the trials that the search chose by.
        tested: names of the trials used for nothing else; without any, the held-out trials test too.
        known: effects of the model that it began with, NAME@JOINT.
        common: joint offsets that may be the encoder's or the initialisations'.
        left_out: excluded intervals, which follow no model.
        suspected: intervals that may follow no model, not excluded.
        unseen: effects that no trial could show.
        criteria: what decided.
    """

    verdict: Verdict
    findings: Findings
    fitted: Fitted
    rivals: tuple[tuple[Explanation, Fitted], ...]
    stages: dict[str, ErrorSummary]
    over_noise: dict[str, float]
    floor: NoiseFloor
    unexplained: list[Unexplained]
    experiment: Experiment | None
    standard: StandardModel
    held_out: list[str]
    tested: list[str]
    known: tuple[str, ...] = ()
    common: tuple[CommonOffset, ...] = ()
    left_out: tuple[Disturbance, ...] = ()
    suspected: tuple[Disturbance, ...] = ()
    unseen: tuple[Unseen, ...] = ()
    criteria: Criteria = STANDARD

    @property
    def unproven(self) -> tuple[Explanation, ...]:
        """Large improvements beside the chosen effects that the held-out segments are too few to prove."""
        return tuple(self.findings.unproven(self.criteria)[:UNPROVEN]) if self.verdict.kind in NOT_ALL else ()

    def errors(self) -> ModelErrors:
        """Return the error of each stage for the model file and diagnosis.json [rad]."""
        overall = {stage: summary.overall for stage, summary in self.stages.items()}
        joints = {stage: summary.joints for stage, summary in self.stages.items()}
        over_noise = self.over_noise["with_effects"]
        return ModelErrors(**overall, noise_floor=self.floor.overall, over_noise=over_noise, joints=joints)


def diagnose_recording(
    recording: Recording,
    effects: Sequence[type[Effect]],
    step: float = 0.002,
    seed: int = 0,
    say: Callable[[str], None] = print,
    known: ModelFile | None = None,
    criteria: Criteria = STANDARD,
) -> Diagnosis:
    """Find out which effect a recording's nominal model lacks.

    Args:
        recording: two or more trials.
        effects: the catalogue to search, a user's own effects included.
        step: simulation step of the free runs whose errors are stated [s].
        seed: which trials are held out, and which test.
        say: takes progress lines.
        known: the model to begin with, whose effects are no news; None: what the recording's owner states.
        criteria: what decides.
    """
    say = BestSoFar(say)
    recording = in_time(recording, effects, say, known)
    recording = in_steps(recording, effects, known, say)
    whole = Inquiry(recording, effects, seed, say, known, criteria)
    standard = fit_standard_model(*whole.parts[:2], noise_with_links(recording), known, effects)
    first = standard.sentence(common_unit(recording.shown.values()))
    say.answer, say.following = first.partition(";")[0], "the stated model with its constants refitted"
    say(first)
    inquiry, left_out, suspected = beside_disturbances(replace(whole, standard=standard.proposal))
    search, findings, simulations, _ = answer = inquiry.answer
    if findings.stopped:
        say(f"stopped early, after {search.shooting.simulated:.2g} simulated steps; next: {findings.stopped}")
    _, held_out, tested = inquiry.parts
    test = held_out if tested is None else tested
    untouched = HeldOut(search.shooting, test, search.noise, nominal_model(test, known).offsets)
    verdict = in_simpler_laws(answer, without_needless(answer))
    verdict = no_worse(verdict, standard, search, simulations, untouched)

    def tested_with(chosen: Explanation) -> tuple[dict[str, ErrorSummary], dict[str, float]]:
        models = {"refitted": findings.base.fit.model, "with_effects": simulations.final(chosen).model}
        return test_errors(search, test, models, step)

    summaries, over_noise = tested_with(verdict.chosen)
    if over_noise["with_effects"] > over_noise["refitted"] and verdict.chosen.effects:
        say(f"{verdict.chosen.label}: worse than without it on the test trials; not recommended")
        verdict = Verdict("unknown_effect", findings.base)
        summaries, over_noise = tested_with(findings.base)
    fitted = simulations.final(verdict.chosen)
    say(f"verdict {verdict.kind}: {verdict.chosen.label}")
    rivals = tuple((one, simulations.final(one)) for one in verdict.rivals)
    diagnosis = Diagnosis(
        verdict=verdict,
        findings=findings,
        fitted=fitted,
        rivals=rivals,
        stages=summaries,
        over_noise=over_noise,
        floor=simulations.floor,
        unexplained=simulations.unexplained(verdict.chosen, beside_base=verdict.kind == "unknown_effect"),
        experiment=None,
        standard=standard,
        held_out=[trial.name for trial in held_out.trials],
        tested=[trial.name for trial in tested.trials] if tested else [],
        known=tuple(term.label for term in search.start.terms),
        common=common_offsets(findings.base, search.shooting.sizes) if verdict.kind == "adequate" else (),
        left_out=left_out,
        suspected=suspected,
        unseen=unseen(effects, search.shooting.sizes, [term.label for term in fitted.model.terms]),
        criteria=criteria,
    )
    fits = open_fits(diagnosis)
    if len(fits) == 1:
        return diagnosis
    extended = not diagnosis.rivals
    experiment = next_experiment(search.shooting, inquiry.recording, fits, search.noise, seed, criteria, extended)
    return replace(diagnosis, experiment=experiment)


def without_needless(answer: Answer) -> Verdict:
    """Return the verdict without the effects whose final intervals include their neutral values.

    It stays as it is if the others alone are not as good on the held-out trials.
    """
    search, findings, simulations, verdict = answer
    chosen = verdict.chosen
    final = simulations.final(chosen)
    out = needless(final.model, final.fit, final.half_width, len(search.start.terms))
    first = [first_term(final.model, chosen.effects, place) for place in range(len(chosen.effects))]
    idle = [k for k, one in enumerate(chosen.effects) if out.issuperset(range(first[k], first[k] + len(one.joints)))]
    if not idle or len(idle) == len(chosen.effects):
        return verdict
    less = search.explained(without(search, chosen, *idle), findings.looked)
    if not as_good(less.judgement, chosen.judgement, search.criteria):
        return verdict
    return instead_of(verdict, less)


def in_simpler_laws(answer: Answer, verdict: Verdict) -> Verdict:
    """Return the verdict with each effect as the simpler law that it becomes at a value within its final interval.

    It stays as it is if the simpler law is not as good on the held-out trials.
    """
    search, findings, simulations, _ = answer
    for place in reversed(range(len(verdict.chosen.effects))):
        chosen = verdict.chosen
        final, law = simulations.final(chosen), chosen.effects[place]
        names = reached(law.effect, final.fit, final.half_width, first_term(final.model, chosen.effects, place))
        beside = named_by((*chosen.effects[:place], *chosen.effects[place + 1 :]))
        simpler = [
            one
            for one in search.new(search.candidates)
            if one.effect.name in names and one.joints == law.joints and not named_by((one,)) & beside
        ]
        if not simpler:
            continue
        left = without(search, chosen, place)
        parent = search.frozen(left.fit)
        refitted = (stepped(search.problem, parent, one, MORE_STEPS) for one in simpler)
        best, begun = min(refitted, key=lambda one: one[1].cost)
        tried = refit(search, (*left.effects, best), begun.model)
        if as_good((less := search.explained(tried, findings.looked)).judgement, chosen.judgement, search.criteria):
            verdict = instead_of(verdict, less)
    return verdict


def instead_of(verdict: Verdict, less: Explanation) -> Verdict:
    """Return the verdict with a simpler explanation, which is no rival of itself."""
    rivals = tuple(one for one in verdict.rivals if named_by(one.effects) != named_by(less.effects))
    return Verdict("missing_effect" if verdict.kind == "ambiguous" and not rivals else verdict.kind, less, rivals)


def no_worse(
    verdict: Verdict, standard: StandardModel, search: Search, simulations: Simulations, untouched: HeldOut
) -> Verdict:
    """Return the verdict, or the standard model if the verdict does not beat it on untouched trials.

    A complete explanation may be worse by `criteria.detail` of the squared error, as its law may differ from the true
    one in detail. A partial one must be better by `criteria.least_gain` if it has more parameters than the standard
    model, and may be worse by as much otherwise. A verdict of `adequate` needs no effects and is kept. Where both are
    complete, segments favour what was found and whole trials the standard model: the data cannot tell them apart.
    """
    if verdict.kind == "adequate" or standard.fit is None:
        return verdict
    alike = search.criteria.detail
    if verdict.kind in NOT_ALL:
        richer = verdict.chosen.size > sum(one.size for one in standard.effects)
        alike = search.criteria.least_gain * (-1.0 if richer else 1.0)
    if not untouched.worse(simulations.final(verdict.chosen).model, standard.model, alike):
        return verdict
    search.say("what was found does not beat the standard model on untouched trials")
    fitted = fit(search.problem, standard.model, search.unknowns(standard.model), iterations=0)
    judged = search.judged(standard.model)
    better = gain(search.base.judgement, judged)
    usual = Explanation(standard.effects, fitted, judged, 1.0, better)
    if not all(complete(one, search.base, search.criteria) for one in (usual, verdict.chosen)):
        return Verdict("unknown_effect", usual)
    others = (one for one in (verdict.chosen, *verdict.rivals) if named_by(one.effects) != named_by(usual.effects))
    return Verdict("ambiguous", usual, tuple(others))


def in_steps(recording: Recording, effects: Sequence[type[Effect]], known: ModelFile | None, say: Say) -> Recording:
    """Return the recording with the simulation steps that its sensors require.

    Raises:
        InputError: gains and inertias require more than `MOST_STEPS` steps per row.
    """
    fine = resolved(recording, effects, say, known)
    steps = steps_per_row(fine, joint_scales(fine)[0].time)
    if steps > MOST_STEPS:
        raise InputError(
            f"{recording.rig.path}: gains and inertias call for {steps} steps of simulation a row, at most "
            f"{MOST_STEPS} are made; check kp, kd, nominal.reflected_inertia and the inertias of the URDF"
        )
    say(f"{steps} steps of simulation a sample")
    return fine


def open_fits(diagnosis: Diagnosis) -> dict[str, Fit]:
    """Return the fits of the chosen model and of its rivals, or without rivals, of the unproven explanations."""
    chosen = diagnosis.verdict.chosen
    fits = {chosen.label if chosen.effects else "none of them": diagnosis.fitted.fit}
    if diagnosis.rivals:
        return fits | {one.label: fitted.fit for one, fitted in diagnosis.rivals}
    return fits | {one.label: one.fit for one in diagnosis.unproven}


def test_errors(
    search: Search, test: Recording, models: Mapping[str, Model], step: float
) -> tuple[dict[str, ErrorSummary], dict[str, float]]:
    """Return free-running errors as stated and of fitted models [rad], and errors of their segments over the noise.

    Joint offsets of initialisations that a model has not seen are fitted; `step` is that of the free runs [s].
    """
    problem = Problem(search.shooting, search.windows(test))
    stated = nominal_model(test, search.known)
    summaries = {"nominal": free_run_error(test, free_run(test, stated, step))}
    over_noise = {}
    for stage, model in models.items():
        found = model.with_offsets(stated.offsets)
        problem.linearise_starts(found)
        judged = judge(problem, test, found)
        over_noise[stage] = judged.error
        seen = model.with_offsets(judged.model.offsets)
        summaries[stage] = free_run_error(test, free_run(test, seen, step))
    return summaries, over_noise


def write_experiment(diagnosis: Diagnosis, folder: Path) -> Path | None:
    """Write the command file of the next experiment if one decides; return its path."""
    experiment = diagnosis.experiment
    return experiment.write(folder) if experiment and experiment.decides else None


class Unseen(NamedTuple):
    """Effect at a joint that the trials cannot reveal.

    Attributes:
        effect: its name.
        joint: where.
        why: what the recording lacks.
    """

    effect: str
    joint: str
    why: str


def unseen(effects: Sequence[type[Effect]], sizes: Mapping[str, Scales], named: Collection[str]) -> tuple[Unseen, ...]:
    """Return effects that no trial with joints of these sizes could show, but for those that were `named`."""
    found = (
        Unseen(effect_path(e), joint, why) for e in effects for joint, s in sizes.items() if (why := e.unseen_at(s))
    )
    return tuple(one for one in found if f"{one.effect}@{one.joint}" not in named)
