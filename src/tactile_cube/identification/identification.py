"""Fitting exactly the effects that a user names, one after another, and the error after each step."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from tactile_cube.composition import suggestion
from tactile_cube.drivetrain.effects import resolve
from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelErrors, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.identification.disturbances import in_time
from tactile_cube.identification.fitting.gauss_newton import Fit, fit, noise_inflation
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.resolution import Fitted, resolved
from tactile_cube.identification.search.candidates import candidates
from tactile_cube.identification.search.evidence import Judgement
from tactile_cube.identification.search.proposals import MORE_STEPS, stepped
from tactile_cube.identification.search.residual_starts import residual_candidates
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.verdict import final_model
from tactile_cube.measurement.comparing.error import ErrorSummary, free_run_error
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor, noise_floor, noise_with_links
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, nominal_model
from tactile_cube.measurement.replay.simulator import free_run
from tactile_cube.measurement.split import held_out_split

CHI_SQUARED_95 = 3.84  # of one degree of freedom: squared error [sensor variances] that noise takes off by itself


@dataclass(frozen=True)
class Identification:
    """A fitted model and the error of each stage on the way to it.

    Attributes:
        fitted: the final model with intervals.
        stages: name of a step -> free-running held-out error [rad], from `nominal` to the last effect.
        floor: noise floor of the recording.
        judgement: of the last step's model on the held-out trials, in segments.
        held_out: names of the held-out trials.
    """

    fitted: Fitted
    stages: dict[str, ErrorSummary]
    floor: NoiseFloor
    judgement: Judgement
    held_out: list[str]

    def errors(self) -> ModelErrors:
        """Return the error of each stage for the model file [rad]."""
        return ModelErrors(
            nominal=self.stages["nominal"].overall,
            refitted=self.stages["refitted"].overall,
            with_effects=list(self.stages.values())[-1].overall,
            noise_floor=self.floor.overall,
            over_noise=self.judgement.error,
            joints={stage: summary.joints for stage, summary in self.stages.items()},
        )


def identify_effects(
    recording: Recording,
    effects: Sequence[str],
    step: float = 0.002,
    seed: int = 0,
    say: Callable[[str], None] = print,
) -> Identification:
    """Fit the constants of a rig and the named effects.

    Args:
        recording: two or more trials.
        effects: `NAME@JOINT`; `NAME` alone stands for every joint; dotted paths name a user's own effects. In brackets
            the parameters that are to be fitted, as `diagnose` names them: `viscous_friction(damping, difference)@q2`.
        step: simulation step of the free runs whose errors are stated [s].
        seed: which trials are held out.
        say: takes progress lines.

    Raises:
        InputError: an unknown effect, joint or parameter, or nothing to hold out.
    """
    wanted = [one for text in effects for one in _wanted(text, recording.joints)]
    classes, places = tuple(dict.fromkeys(effect for effect, *_ in wanted)), [one[:2] for one in wanted]
    if twice := next((one for k, one in enumerate(places) if one in places[:k]), None):
        raise InputError(f"effects: '{twice[0].name}@{twice[1]}' is named twice; name it once")
    search, floor = divided(recording, classes, seed, say)
    held_out, base = search.held_out, search.base
    stages = {"nominal": search.start_held_out, "refitted": base.judgement.model}
    current = base.fit
    for effect, joint, parameters in wanted:
        added = with_effect(search, search.frozen(current), effect, joint, parameters).model
        search.problem.linearise_starts(added)
        current = _no_worse(search, current, added)
        label = current.model.terms[-1].label
        stages[f"+ {label}"] = search.judged(current.model).model
        say(f"fitted {label}")
    fitted = final_model(search, Problem(search.shooting, search.all_windows), current.model)
    judgement = search.judged(fitted.model)
    stages[list(stages)[-1]] = judgement.model
    say("simulating the held-out trials")
    summaries = {k: free_run_error(held_out, free_run(held_out, m, step)) for k, m in stages.items()}
    return Identification(fitted, summaries, floor, judgement, [trial.name for trial in held_out.trials])


def _no_worse(search: Search, before: Fit, added: Model) -> Fit:
    """Refit all unknowns with an effect added; if held-out trials get worse, return the better of old and new."""
    unknowns = search.unknowns(added)
    found = fit(search.problem, added, unknowns, iterations=4)
    if not search.free_runs.worse(found.model, before.model):
        return found
    kept = fit(search.problem, added, unknowns, iterations=0)
    return min((kept, found), key=lambda one: search.free_runs.error(one.model))


def judge_known(recording: Recording, model: ModelFile, seed: int = 0) -> Judgement:
    """Judge an identified model, without a refit, on the trials that `identify` would hold out.

    Args:
        recording: two or more trials, of the model's joints.
        model: identified on another recording.
        seed: which trials are held out.
    """
    effects = resolve([one.effect for one in model.drive_effects], recording.joints)
    classes = tuple(dict.fromkeys(effect for effect, _ in effects))
    search, _ = divided(recording, classes, seed, lambda line: None)
    return search.judged(nominal_model(search.held_out, model))


def divided(
    recording: Recording, effects: Sequence[type[Effect]], seed: int, say: Callable[[str], None]
) -> tuple[Search, NoiseFloor]:
    """Return the trials to fit and those to judge by, with the effects compiled in, and the noise floor."""
    recording = in_time(resolved(recording, effects, say, None), effects, say)
    fitted, held_out = held_out_split(recording, seed=seed)
    return Search(fitted, held_out, noise_with_links(recording), effects, say), noise_floor(recording)


def _wanted(text: str, joints: Sequence[str]) -> list[tuple[type[Effect], str, tuple[str, ...]]]:
    """Return the effects, joints and the parameters that were named in brackets behind the effect or the joint."""
    found = re.search(r"\(([^()]*)\)", text)
    names = tuple(filter(None, (name.strip() for name in found.group(1).split(",")))) if found else ()
    placed = resolve([text.replace(found.group(), "") if found else text], joints)
    for effect, joint in placed:
        known = [parameter.name for parameter in effect.parameters]
        for name in names:
            if name not in known:
                raise InputError(
                    f"effects: '{effect.name}@{joint}({name})': '{name}' is none of its parameters "
                    f"({', '.join(known)}){suggestion(name, known)}"
                )
    return [(effect, joint, names) for effect, joint in placed]


def with_effect(search: Search, frozen: Fit, effect: type[Effect], joint: str, parameters: Sequence[str] = ()) -> Fit:
    """Return a frozen fit with one more effect, in whichever of its forms and from whichever start it does best.

    Of fits that differ by less than noise makes them, it is that of the first start, the usual one: a payload has a
    positive mass. Everything else stays frozen: the model that it returns is where a fit of everything begins.
    With `parameters`, those of a form are fitted that has them, or beside a form's own.
    """
    every = candidates(search.shooting.sizes, [effect])
    every += residual_candidates(search.problem, search.fitted, frozen, [effect])
    options = [c for c in every if c.joints == (joint,)]
    if not options:
        raise InputError(
            f"effects: '{effect.name}@{joint}' cannot act there: the joint has no neighbour or no joint coupled to it, "
            "or did not move enough; leave it out"
        )
    if parameters and not (having := [c for c in options if set(parameters) <= c.form.keys()]):
        neutral = {p.name: p.neutral for p in effect.parameters if p.name in parameters}
        having = [replace(c, form={**neutral, **c.form}) for c in options]
    wanted = having if parameters else options
    refitted = [stepped(search.problem, frozen, option, MORE_STEPS)[1] for option in wanted]
    best = min(one.cost for one in refitted)
    same = best + CHI_SQUARED_95 * noise_inflation(search.problem, best)
    return next(one for one in refitted if one.cost <= same)
