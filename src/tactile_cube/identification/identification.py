"""Fitting exactly the effects that a user names, one after another, and the error after each step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tactile_cube.drivetrain.effects import resolve
from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelErrors, ModelFile
from tactile_cube.identification.fitting.gauss_newton import Fit, fit
from tactile_cube.identification.fitting.intervals import Fitted, final_fit
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.resolution import resolved
from tactile_cube.identification.late_commands import in_time
from tactile_cube.identification.search.candidates import candidates
from tactile_cube.identification.search.evidence import Judgement
from tactile_cube.identification.search.residual_starts import residual_candidates
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.simulations import with_offsets
from tactile_cube.measurement.comparing.error import ErrorSummary, free_run_error
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor, noise_floor
from tactile_cube.measurement.noise import sensor_noise
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.nominal import nominal_model
from tactile_cube.measurement.replay.simulator import Engine, free_run
from tactile_cube.measurement.split import held_out_split


@dataclass(frozen=True)
class Identification:
    """A fitted model and the staircase that led to it.

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
        """The staircase as the model file states it [rad]."""
        return ModelErrors(
            nominal=self.stages["nominal"].overall,
            refitted=self.stages["refitted"].overall,
            with_effects=list(self.stages.values())[-1].overall,
            noise_floor=self.floor.overall,
            over_noise=self.judgement.error,
            joints={stage: summary.joints for stage, summary in self.stages.items()},
        )


def identify(
    recording: Recording,
    effects: Sequence[str],
    engine: Engine = "pybullet",
    step: float = 0.002,
    seed: int = 0,
    say: Callable[[str], None] = print,
) -> Identification:
    """Fit the constants of a rig and the named effects.

    Args:
        recording: two or more trials.
        effects: `NAME@JOINT`; `NAME` alone stands for every joint; dotted paths name a user's own effects.
        engine: of the free-running errors that are stated.
        step: its simulation step [s].
        seed: which trials are held out.
        say: takes progress lines.

    Raises:
        InputError: an unknown effect or joint, or nothing to hold out.
    """
    wanted = resolve(effects, recording.joints)
    classes = tuple(dict.fromkeys(effect for effect, _ in wanted))
    search, floor = _divided(recording, classes, seed, say)
    held_out, base = search.held_out, search.fit_base()
    stages = {"nominal": search.start_held_out, "refitted": base.judgement.model}
    current, judgement = base.fit, base.judgement
    for effect, joint in wanted:
        current = _with_effect(search, current, effect, joint)
        label = current.model.terms[-1].label
        judgement = search.judged(current.model)
        stages[f"+ {label}"] = judgement.model
        say(f"fitted {label}")
    fitted = final_fit(Problem(search.shooting, search.all_windows), current.model, search.unknowns(current.model))
    last = list(stages)[-1]
    stages[last] = with_offsets(fitted.model, stages[last])
    say("simulating the held-out trials")
    summaries = {k: free_run_error(held_out, free_run(held_out, m, engine, step)) for k, m in stages.items()}
    return Identification(fitted, summaries, floor, judgement, [trial.name for trial in held_out.trials])


def judge_known(recording: Recording, model: ModelFile, seed: int = 0) -> Judgement:
    """How an identified model does, none of its numbers refitted, on the trials that `identify` would hold out.

    Args:
        recording: two or more trials, of the model's joints.
        model: identified on another recording.
        seed: which trials are held out.
    """
    effects = resolve([one.effect for one in model.drive_effects], recording.joints)
    classes = tuple(dict.fromkeys(effect for effect, _ in effects))
    search, _ = _divided(recording, classes, seed, lambda line: None)
    return search.judged(nominal_model(search.held_out, model))


def _divided(
    recording: Recording, effects: Sequence[type[Effect]], seed: int, say: Callable[[str], None]
) -> tuple[Search, NoiseFloor]:
    """The trials to fit and those to judge by, with the effects compiled in."""
    recording = in_time(resolved(recording, effects, say), effects, say)
    fitted, held_out = held_out_split(recording, seed=seed)
    return Search(fitted, held_out, sensor_noise(recording), effects, say), noise_floor(recording)


def _with_effect(search: Search, current: Fit, effect: type[Effect], joint: str) -> Fit:
    """The fit with one more effect, in whichever of its forms and from whichever start it does best."""
    frozen = search.frozen(current)
    every = candidates(search.shooting.sizes, [effect])
    every += residual_candidates(search.problem, search.fitted, frozen, [effect])
    options = [c for c in every if c.joints == (joint,)]
    refitted = [search.refit(frozen, option)[1] for option in options]
    best = refitted[int(np.argmin([one.cost for one in refitted]))]
    search.problem.linearise_starts(best.model)
    return fit(search.problem, best.model, search.unknowns(best.model), iterations=4)
