"""A diagnosis from beginning to end: split, search, decide, refit, state errors, propose the next experiment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelErrors, ModelFile
from tactile_cube.identification.fitting.intervals import Fitted, final_fit
from tactile_cube.identification.fitting.model import Model
from tactile_cube.identification.fitting.noise import sensor_noise
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.free_run import free_run, free_run_error
from tactile_cube.identification.next_experiment import Experiment, next_experiment
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.residual_shape import Shape, black_box, missing_torques, shapes
from tactile_cube.identification.search.search import Findings, Search
from tactile_cube.identification.search.shared_offset import CommonOffset, common_offsets
from tactile_cube.identification.verdict import Verdict, decide, unexplained_joints
from tactile_cube.measurement.comparing.error import ErrorSummary
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor, noise_floor
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.rig_replay import Engine
from tactile_cube.measurement.split import held_out_split

SHOWN_SHAPES = 6
FOLLOWS_SIGNALS = 0.25  # share of what is left that a black box explains, from which on something else is missing


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
        stages: nominal, refitted, with_effects: free-running held-out errors.
        floor: noise floor of the recording.
        unexplained: what is left, joint by joint; empty unless something is.
        experiment: what would tell the rivals apart; None without rivals.
        held_out: names of the held-out trials.
        known: effects of the model that it began with, NAME@JOINT.
        common: joint offsets that may be the encoder's or the initialisations'.
    """

    verdict: Verdict
    findings: Findings
    fitted: Fitted
    rivals: tuple[tuple[Explanation, Fitted], ...]
    stages: dict[str, ErrorSummary]
    floor: NoiseFloor
    unexplained: list[Unexplained]
    experiment: Experiment | None
    held_out: list[str]
    known: tuple[str, ...] = ()
    common: tuple[CommonOffset, ...] = ()

    def errors(self) -> ModelErrors:
        """The staircase as the model file and diagnosis.json state it [rad]."""
        overall = {stage: summary.overall for stage, summary in self.stages.items()}
        joints = {stage: summary.joints for stage, summary in self.stages.items()}
        return ModelErrors(**overall, noise_floor=self.floor.overall, joints=joints)


def diagnose(
    recording: Recording,
    effects: Sequence[type[Effect]],
    engine: Engine = "pybullet",
    step: float = 0.002,
    seed: int = 0,
    say: Callable[[str], None] = print,
    known: ModelFile | None = None,
) -> Diagnosis:
    """Find out which effect a recording's nominal model lacks.

    Args:
        recording: two or more trials.
        effects: the catalogue to search, a user's own effects included.
        engine: of the free-running errors that are stated.
        step: its simulation step [s].
        seed: which trials are held out.
        say: takes progress lines.
        known: the model to begin with, whose effects are no news; None: what the recording's owner states.
    """
    fitted_part, held_out = held_out_split(recording, seed=seed)
    noise = sensor_noise(recording)
    search = Search(fitted_part, held_out, noise, effects, say, known)
    findings = search.run()
    verdict, floor = decide(findings), noise_floor(recording)
    problem = Problem(search.shooting, search.all_stretches)
    fitted = final_fit(problem, verdict.chosen.fit.model, search.unknowns(verdict.chosen.fit.model))
    stages = {
        "nominal": search.start_held_out,
        "refitted": findings.base.judgement.model,
        "with_effects": with_offsets(fitted.model, verdict.chosen.judgement.model),
    }
    summaries = {k: free_run_error(held_out, free_run(held_out, m, engine, step)) for k, m in stages.items()}
    if floor.source == "repeats" and summaries["with_effects"].overall <= floor.overall:
        verdict = decide(findings, as_repeats=True)
    unexplained = _unexplained(search, verdict, findings.base)
    if verdict.kind != "unknown_effect" and follows_signals(unexplained):
        verdict = replace(verdict, kind="unknown_effect", rivals=())
        unexplained = _unexplained(search, verdict, findings.base)
    say(f"verdict {verdict.kind}: {verdict.chosen.label}")
    rivals = tuple((one, final_fit(problem, one.fit.model, search.unknowns(one.fit.model))) for one in verdict.rivals)
    experiment = None
    if rivals:
        models = {verdict.chosen.label: fitted.model} | {one.label: fit.model for one, fit in rivals}
        experiment = next_experiment(search.shooting, recording, models, noise, seed)
    return Diagnosis(
        verdict=verdict,
        findings=findings,
        fitted=fitted,
        rivals=rivals,
        stages=summaries,
        floor=floor,
        unexplained=unexplained,
        experiment=experiment,
        held_out=[trial.name for trial in held_out.trials],
        known=tuple(term.label for term in search.start.terms),
        common=common_offsets(findings.base, search.shooting.sizes) if verdict.kind == "adequate" else (),
    )


def follows_signals(unexplained: Sequence[Unexplained]) -> bool:
    """Whether what is left is a function of the signals, and so no noise: what was named is not the whole of it."""
    return any(one.black_box > FOLLOWS_SIGNALS for one in unexplained)


def with_offsets(model: Model, judged: Model) -> Model:
    """The final model with the joint offsets that were found for the held-out initialisations."""
    return Model(model.constants, model.terms, {**judged.posture, **model.posture})


def _unexplained(search: Search, verdict: Verdict, base: Explanation) -> list[Unexplained]:
    joints = unexplained_joints(verdict.chosen, search.fitted.joints)
    if not joints:
        return []
    beside = {"the recommended model": verdict.chosen.judgement}
    if verdict.kind == "unknown_effect":  # effects that help and are not the cause blur its shape
        beside["the model with refitted constants"] = base.judgement
    missing = {
        name: missing_torques(search.judges, search.held_out, judged.model, judged.residual)
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
    return diagnosis.experiment.write(folder) if diagnosis.experiment else None
