"""Fitting exactly the effects that a user names, one after another, and the error after each step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tactile_cube.drivetrain.effects import resolve
from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelErrors
from tactile_cube.identification.diagnosis import with_offsets
from tactile_cube.identification.fitting.gauss_newton import Fit, fit
from tactile_cube.identification.fitting.intervals import Fitted, final_fit
from tactile_cube.identification.fitting.model import Model
from tactile_cube.identification.fitting.noise import sensor_noise
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.resolution import resolved
from tactile_cube.identification.free_run import free_run, free_run_error
from tactile_cube.identification.search.candidates import candidates
from tactile_cube.identification.search.evidence import judge
from tactile_cube.identification.search.residual_starts import residual_candidates
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.comparing.error import ErrorSummary
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor, noise_floor
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.rig_replay import Engine
from tactile_cube.measurement.split import held_out_split


@dataclass(frozen=True)
class Identification:
    """A fitted model and the staircase that led to it.

    Attributes:
        fitted: the final model with intervals.
        stages: name of a step -> free-running held-out error [rad], from `nominal` to the last effect.
        floor: noise floor of the recording.
        held_out: names of the held-out trials.
    """

    fitted: Fitted
    stages: dict[str, ErrorSummary]
    floor: NoiseFloor
    held_out: list[str]

    def errors(self) -> ModelErrors:
        """The staircase as the model file states it [rad]."""
        return ModelErrors(
            nominal=self.stages["nominal"].overall,
            refitted=self.stages["refitted"].overall,
            with_effects=list(self.stages.values())[-1].overall,
            noise_floor=self.floor.overall,
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
    recording = resolved(recording, classes, say)
    fitted_part, held_out = held_out_split(recording, seed=seed)
    search = Search(fitted_part, held_out, sensor_noise(recording), classes, say)
    base = search.fit_base()
    stages = {"nominal": search.start_held_out, "refitted": base.judgement.model}
    current = base.fit
    for effect, joint in wanted:
        current = _with_effect(search, current, effect, joint)
        label = current.model.terms[-1].label
        stages[f"+ {label}"] = _judged(search, held_out, current.model)
        say(f"fitted {label}")
    fitted = final_fit(Problem(search.shooting, search.all_windows), current.model, search.unknowns(current.model))
    last = list(stages)[-1]
    stages[last] = with_offsets(fitted.model, stages[last])
    say("simulating the held-out trials")
    summaries = {k: free_run_error(held_out, free_run(held_out, m, engine, step)) for k, m in stages.items()}
    return Identification(fitted, summaries, noise_floor(recording), [trial.name for trial in held_out.trials])


def _judged(search: Search, held_out: Recording, model: Model) -> Model:
    """The model with the joint offsets of the held-out initialisations."""
    full = search.with_known_offsets(model)
    search.validation.linearise_starts(full)
    return judge(search.validation, held_out, full).model


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
