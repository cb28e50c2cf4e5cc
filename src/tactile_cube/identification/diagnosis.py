"""A diagnosis from beginning to end: split, search, decide, refit, test, propose the next experiment."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelErrors, ModelFile
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.fitting.intervals import Fitted, final_fit
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.resolution import resolved
from tactile_cube.identification.next_experiment import Experiment, next_experiment
from tactile_cube.identification.search.evidence import Judgement, judge
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.residual_shape import Shape, black_box, missing_torques, shapes
from tactile_cube.identification.search.search import Findings, Search
from tactile_cube.identification.search.shared_offset import CommonOffset, common_offsets
from tactile_cube.identification.verdict import Questions, Verdict, decide, unexplained_joints
from tactile_cube.measurement.comparing.error import ErrorSummary, free_run_error
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor, noise_floor
from tactile_cube.measurement.noise import sensor_noise
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.nominal import nominal_model
from tactile_cube.measurement.replay.simulator import Engine, free_run
from tactile_cube.measurement.split import held_out_split, turned, with_test_part

SHOWN_SHAPES = 6
UNPROVEN = 3
LONGER = 4
"""Times as long as usual that segments are where the usual ones leave much: what a start misread, as where a joint
sticks within a sample, is a smaller part of them."""
NOT_ALL = ("unknown_effect", "partly_explained")
"""Verdicts that say that more is missing than is named."""
LESS = (*NOT_ALL, "ambiguous")
"""Verdicts that do not say what is missing and that it is all, the one that says least first."""


@dataclass(frozen=True)
class Unexplained:
    """What is left at a joint.

    Attributes:
        joint: its name.
        shapes: the missing torque over signals, most telling first.
        black_box: share that a black box could still explain beside the recommended model.
    """

    joint: str
    shapes: list[Shape] = field(repr=False)
    black_box: float


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
        experiment: what would tell rivals, or what is unproven and chance, apart; None without either.
        held_out: names of the trials that the search chose by.
        tested: names of those that nothing was fitted to or chosen by; without any, those that chose test too.
        known: effects of the model that it began with, NAME@JOINT.
        common: joint offsets that may be the encoder's or the initialisations'.
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
    held_out: list[str]
    tested: list[str]
    known: tuple[str, ...] = ()
    common: tuple[CommonOffset, ...] = ()

    @property
    def unproven(self) -> tuple[Explanation, ...]:
        """What would explain much beside the chosen effects, were the held-out segments enough to show it."""
        return self.findings.unproven[:UNPROVEN] if self.verdict.kind in NOT_ALL else ()

    def errors(self) -> ModelErrors:
        """The staircase as the model file and diagnosis.json state it [rad]."""
        overall = {stage: summary.overall for stage, summary in self.stages.items()}
        joints = {stage: summary.joints for stage, summary in self.stages.items()}
        over_noise = self.over_noise["with_effects"]
        return ModelErrors(**overall, noise_floor=self.floor.overall, over_noise=over_noise, joints=joints)


def diagnose(
    recording: Recording,
    effects: Sequence[type[Effect]],
    engine: Engine = "pybullet",
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
        engine: of the free-running errors that are stated.
        step: its simulation step [s].
        seed: which trials are held out, and which test.
        say: takes progress lines.
        known: the model to begin with, whose effects are no news; None: what the recording's owner states.
        criteria: what decides.
    """
    recording = resolved(recording, effects, say, known)
    fitted_part, held_out = held_out_split(recording, seed=seed)
    fitted_part, tested = with_test_part(fitted_part, len(recording.trials), seed)
    noise = sensor_noise(recording)
    folds = turned(fitted_part, held_out)
    floor = noise_floor(recording)

    def search_in(longer: int) -> Search:
        return Search(fitted_part, held_out, noise, effects, say, known, criteria, folds, longer)

    def answered(search: Search) -> Answer:
        findings = search.run()
        simulations = Simulations(search, findings.base, floor, engine, step)
        return Answer(search, findings, simulations, decide(findings, simulations, criteria))

    search, findings, simulations, verdict = asked(search_in, answered, say)
    fitted = simulations.final(verdict.chosen)
    test = held_out if tested is None else tested
    summaries, over_noise = test_errors(
        search, test, {"refitted": findings.base.fit.model, "with_effects": fitted.model}, engine, step
    )
    say(f"verdict {verdict.kind}: {verdict.chosen.label}")
    rivals = tuple((one, simulations.final(one)) for one in verdict.rivals)
    diagnosis = Diagnosis(
        verdict=verdict,
        findings=findings,
        fitted=fitted,
        rivals=rivals,
        stages=summaries,
        over_noise=over_noise,
        floor=floor,
        unexplained=simulations.unexplained(verdict.chosen, beside_base=verdict.kind == "unknown_effect"),
        experiment=None,
        held_out=[trial.name for trial in held_out.trials],
        tested=[trial.name for trial in tested.trials] if tested else [],
        known=tuple(term.label for term in search.start.terms),
        common=common_offsets(findings.base, search.shooting.sizes) if verdict.kind == "adequate" else (),
    )
    fits = open_fits(diagnosis)
    if len(fits) == 1:
        return diagnosis
    extended = not diagnosis.rivals
    experiment = next_experiment(search.shooting, recording, fits, noise, seed, criteria, extended)
    return replace(diagnosis, experiment=experiment)


class Answer(NamedTuple):
    """A verdict and what it came from."""

    search: Search
    findings: Findings
    simulations: Simulations
    verdict: Verdict

    @property
    def says(self) -> tuple[int, bool]:
        """How much it says, to be compared: how nearly it names all that is missing, then whether little is left."""
        little_left = self.verdict.chosen.largest_error <= self.search.criteria.tolerated
        return (LESS.index(self.verdict.kind) if self.verdict.kind in LESS else len(LESS)), little_left


def asked(
    search_in: Callable[[int], Search], answered: Callable[[Search], Answer], say: Callable[[str], None]
) -> Answer:
    """The answer of a search in usual segments, or in longer ones, where only those name all that is missing.

    Where much is left, or several laws do as well, a misread start is a smaller part of a longer segment, and what is
    slower shows. Where nothing is left, but free runs are further from the measurement than it is from itself, starts
    that are fitted hide what is slower than a segment.

    Args:
        search_in: prepares a search in segments so many times as long as usual.
        answered: runs it.
        say: takes progress lines.
    """
    first = answered(search_in(1))
    base, criteria = first.findings.base, first.search.criteria
    nothing_left = base.largest_error <= criteria.floor
    if first.simulations.as_repeats(base) if nothing_left else first.says == (len(LESS), True):
        return first
    if not first.findings.levels and base.error > criteria.far:
        return first  # short segments show plenty of what nothing explains
    longer = search_in(LONGER)
    if longer.rows <= first.search.rows:
        return first
    say(f"{first.verdict.kind}; once more in segments of {longer.rows} samples instead of {first.search.rows}")
    if nothing_left:
        return first if longer.fit_base().largest_error <= criteria.adequate else answered(longer)
    second = answered(longer)
    return second if second.verdict.kind not in NOT_ALL and second.says > first.says else first


def open_fits(diagnosis: Diagnosis) -> dict[str, Fit]:
    """The chosen model and those that may be true as well: its rivals, or else what these trials do not prove."""
    chosen = diagnosis.verdict.chosen
    fits = {chosen.label if chosen.effects else "none of them": diagnosis.fitted.fit}
    if diagnosis.rivals:
        return fits | {one.label: fitted.fit for one, fitted in diagnosis.rivals}
    return fits | {one.label: one.fit for one in diagnosis.unproven}


def test_errors(
    search: Search, test: Recording, models: Mapping[str, Model], engine: Engine, step: float
) -> tuple[dict[str, ErrorSummary], dict[str, float]]:
    """Free-running errors of the model as stated and of others [rad], and their errors of segments over the noise.

    Args:
        search: cuts trials into segments.
        test: trials to test by.
        models: fitted; the joint offsets of initialisations that they have not seen are fitted here.
        engine: of the free runs.
        step: its simulation step [s].
    """
    problem = Problem(search.shooting, search.windows(test))
    stated = nominal_model(test, search.known)
    summaries = {"nominal": free_run_error(test, free_run(test, stated, engine, step))}
    over_noise = {}
    for stage, model in models.items():
        found = Model(model.constants, model.terms, {**stated.offsets, **model.offsets})
        problem.linearise_starts(found)
        judged = judge(problem, test, found)
        over_noise[stage] = judged.error
        seen = with_offsets(model, judged.model)
        summaries[stage] = free_run_error(test, free_run(test, seen, engine, step))
    return summaries, over_noise


class Simulations(Questions):
    """Answers what a decision asks of an explanation, each question once."""

    def __init__(self, search: Search, base: Explanation, floor: NoiseFloor, engine: Engine, step: float) -> None:
        self.search, self.base, self.floor, self.engine, self.step = search, base, floor, engine, step
        self.problem = Problem(search.shooting, search.all_windows)
        self._final: dict[str, Fitted] = {}
        self._errors: dict[str, ErrorSummary] = {}

    def as_repeats(self, one: Explanation) -> bool:
        """See `Questions`."""
        most = self.search.criteria.adequate * self.floor.overall
        return self.floor.source == "repeats" and self.free_error(one).overall <= most

    def follows_signals(self, one: Explanation) -> bool:
        """See `Questions`."""
        return follows_signals(self.unexplained(one), self.search.criteria)

    def alike(self, one: Explanation, other: Explanation) -> bool:
        """See `Questions`."""
        validation = self.search.validation
        first, second = validation.predictions([one.judgement.model, other.judgement.model])
        difference = validation.limited(first - second) * validation.weight
        return bool(np.mean(difference[validation.weight > 0.0] ** 2) < self.search.criteria.alike**2)

    def final(self, one: Explanation) -> Fitted:
        """An explanation refitted on all fitted trials, with intervals."""
        if one.label not in self._final:
            self._final[one.label] = final_fit(self.problem, one.fit.model, self.search.unknowns(one.fit.model))
        return self._final[one.label]

    def free_error(self, one: Explanation) -> ErrorSummary:
        """Error of its free run on the held-out trials [rad]."""
        if one.label not in self._errors:
            self._errors[one.label] = self.simulated_error(one)
        return self._errors[one.label]

    def simulated_error(self, one: Explanation) -> ErrorSummary:
        """The same, simulated anew."""
        model = with_offsets(self.final(one).model, one.judgement.model)
        return free_run_error(self.search.held_out, free_run(self.search.held_out, model, self.engine, self.step))

    def unexplained(self, one: Explanation, beside_base: bool = False) -> list[Unexplained]:
        """What is left at each joint that is not explained; `beside_base`, also beside the base model.

        Effects that help and are not the cause blur the shape of what is missing.
        """
        search = self.search
        joints = unexplained_joints(one, search.fitted.joints, search.criteria)
        judgements = {"the recommended model": one.judgement}
        judgements |= {"the model with refitted constants": self.base.judgement} if beside_base else {}
        return _unexplained(search, joints, judgements) if joints else []


def follows_signals(unexplained: Sequence[Unexplained], criteria: Criteria = STANDARD) -> bool:
    """Whether what is left is a function of the signals, and so no noise: what was named is not the whole of it."""
    return any(one.black_box > criteria.large_gain for one in unexplained)


def with_offsets(model: Model, judged: Model) -> Model:
    """The final model with the joint offsets that were found for the held-out initialisations."""
    return Model(model.constants, model.terms, {**judged.offsets, **model.offsets})


def _unexplained(search: Search, joints: Sequence[str], beside: Mapping[str, Judgement]) -> list[Unexplained]:
    missing = {
        name: missing_torques(search.validation, search.held_out, judged.model, judged.residual)
        for name, judged in beside.items()
    }
    found = []
    for j, joint in enumerate(search.fitted.joints):
        if joint in joints:
            curves = [[replace(one, beside=name) for one in shapes(torques[j])] for name, torques in missing.items()]
            clearest = max(curves, key=lambda shown: shown[0].explained)
            left = black_box(missing["the recommended model"][j])
            found.append(Unexplained(joint, clearest[:SHOWN_SHAPES], left))
    return found


def write_experiment(diagnosis: Diagnosis, folder: Path) -> Path | None:
    """The command file of the next experiment, if one is needed."""
    experiment = diagnosis.experiment
    return experiment.write(folder) if experiment and experiment.decides else None
