"""What a workbench holds: a recording, a model that grows effect by effect, and its error after each step.

Nothing here knows of a browser, and nothing is computed here that `compare`, `identify` and `diagnose` do not compute.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_cube.api.comparison import modelled, opened
from tactile_cube.api.job import PathLike, as_input_errors
from tactile_cube.drivetrain.effects import catalogue, find_effect, import_own_effects, resolve
from tactile_cube.drivetrain.model_file import ModelErrors, ModelFile, write_model
from tactile_cube.errors import InputError
from tactile_cube.identification.diagnosis import Unseen, unseen
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.fitting.intervals import NORMAL_95, Fitted, final_fit, standard_errors
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.identification.identification import divided, with_effect
from tactile_cube.identification.model_files import UNITS, model_file
from tactile_cube.identification.next_experiment import Experiment, next_experiment
from tactile_cube.identification.search.division import BRIEF
from tactile_cube.identification.search.evidence import Judgement
from tactile_cube.identification.search.proposals import wanted
from tactile_cube.identification.search.residual_shape import Missing, black_box, missing_torques
from tactile_cube.identification.search.screening import Score, Screen, resized, screen
from tactile_cube.measurement.bench import without_touches
from tactile_cube.measurement.comparing.comparison import USUAL_STEP, Comparison, compare_recording, describe_comparison
from tactile_cube.measurement.comparing.error import ErrorSummary, free_run_error, raw_residuals, summarise_errors
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.model import Model, effect_path
from tactile_cube.measurement.replay.simulator import Simulated, free_run
from tactile_cube.measurement.units import of_joint
from tactile_cube.whole_file import written_together
from tactile_cube.workbench.background import Diagnosing

Array = NDArray[np.float64]
BY_HAND = "by hand"
AT_ONCE = 24  # candidates of a first look
RANKED = 8  # of them that are shown
ALIKE = 0.95  # correlation of two signatures, beside all constants, from which on these trials do not tell them apart
MOST = 50
"""Changes that can be undone; each keeps a fit and a judgement, some MB."""
COMMAND = "python -m tactile_cube.workbench recording={}"


@dataclass(frozen=True)
class ModelStage:
    """One model on the way, and how it does on the trials that are never fitted.

    Attributes:
        label: `stated`, `refitted`, `+ NAME@JOINT`, `- NAME@JOINT` or `by hand`.
        fit: what it was fitted by; of the stated model, and of values set by hand, the fit that came before.
        model: with the joint offsets of every initialisation.
        judgement: in segments.
        errors: RMS of the free run, joint offsets removed [rad].
        raw: the same with nothing removed [rad].
        half_width: (P,) of the fit's unknowns: what noise and misfit leave unsure, 95 %; zero where nothing was fitted.
    """

    label: str
    fit: Fit
    model: Model
    judgement: Judgement
    errors: ErrorSummary
    raw: ErrorSummary
    half_width: Array


@dataclass(frozen=True)
class Value:
    """A number of the model that a fit may change.

    Attributes:
        key: `CONSTANT@JOINT` or `NAME@JOINT.PARAMETER`.
        value: in the model in force.
        interval: its 95 % interval within the bounds; None where it was set by hand or not fitted.
        unit: SI unit.
        unknown: its bounds; `put` gives a model, which `simulate` takes, with another value.
    """

    key: str
    value: float
    interval: tuple[float, float] | None
    unit: str
    unknown: Unknown


class Workbench:
    """A recording and a model that is compared with it, extended, and saved.

    Attributes:
        recording: as it is simulated: free motion, in steps as short as its sensors call for.
        floor: its noise floor [rad].
        search: the trials fitted and never fitted, with every effect compiled in.
        history: the stages after each change, the last one in force.

    Example:
        >>> bench = Workbench("my_recording")
        >>> print([score.candidate.label for score in bench.candidates("q3")[0]])
        >>> bench.add("stribeck_friction@q3")
        >>> print([(stage.label, stage.errors.overall) for stage in bench.stages], bench.floor.overall)
        >>> bench.save("outputs/my_model")
    """

    @as_input_errors
    def __init__(
        self,
        recording: Recording | PathLike,
        model: ModelFile | PathLike | None = None,
        own_effects: Sequence[str] = (),
        seed: int = 0,
        say: Callable[[str], None] = lambda line: None,
    ) -> None:
        """Divide the trials and refit what the model has already.

        Args:
            recording: what was measured, or its folder; two or more trials of free motion.
            model: to begin with, or its file; None: what the recording states.
            own_effects: dotted paths of the user's own classes, which are imported.
            seed: which trials are never fitted.
            say: takes lines of progress.

        Raises:
            InputError: a recording, a model or an effect that cannot be used.
        """
        import_own_effects(list(own_effects))
        self.own_effects, self.seed, self.say, self.known = tuple(own_effects), seed, say, modelled(model)
        self.opened = opened(recording)
        moving = without_touches(self.opened)
        effects = dict.fromkeys([*catalogue().values(), *(find_effect(name) for name in own_effects)])
        say("dividing the trials")
        self.search, self.floor = divided(moving, tuple(effects), seed, say, self.known)
        known = {one.name: one for part in (self.search.fitted, self.search.held_out) for one in part.trials}
        self.recording = self.search.fitted.with_trials([known[trial.name] for trial in moving.trials])
        base = self.search.fit_base()
        stated = replace(base.fit, model=self.search.start)
        first: tuple[ModelStage, ...] = (self._stage("stated", stated, fitted=False), self._stage("refitted", base.fit))
        self.history = [first]
        self._kept: tuple[Fit, Fit] | None = None

    @property
    def stages(self) -> tuple[ModelStage, ...]:
        """From the stated model to the one in force."""
        return self.history[-1]

    @property
    def stage(self) -> ModelStage:
        """The model in force."""
        return self.stages[-1]

    @property
    def effects(self) -> list[str]:
        """Effects of the model in force, NAME@JOINT."""
        return [term.label for term in self.stage.model.terms]

    @property
    def never_fitted(self) -> list[str]:
        """Names of the trials by which models are judged."""
        return [trial.name for trial in self.search.held_out.trials]

    def trial(self, name: str) -> Trial:
        """One trial by its name."""
        return next(one for one in self.recording.trials if one.name == name)

    def simulate(self, trial: str, model: Model | None = None) -> Simulated:
        """Return one trial simulated freely from its start, by the model in force or another one."""
        one = self.recording.with_trials([self.trial(trial)])
        return free_run(one, model or self.stage.model, USUAL_STEP)[0]

    def comparison(self, trial: str) -> Comparison:
        """Return the model in force beside one trial: errors, regimes, failing intervals."""
        one = self.recording.with_trials([self.trial(trial)])
        return describe_comparison(one, None, [self.simulate(trial)], self.floor, None, USUAL_STEP)

    def missing(self, joint: str) -> Missing:
        """Return the torque that the model in force lacks at a joint, and the signals it may depend on."""
        return self._as_torque(joint, self.stage.judgement.residual)

    def signature(self, score: Score, joint: str) -> Missing:
        """Return the torque that a candidate supplies after a brief refit of its own numbers; see `missing`."""
        search, problem = self.search, self.search.validation
        _, fitted = search.refit(self._frozen(self.stage.fit), resized(score), BRIEF)
        added = fitted.model.with_offsets(search.offsets)
        before, after = problem.predictions([replace(added, terms=added.terms[:-1]), added])
        return self._as_torque(joint, problem.limited(after - before) * problem.weight)

    def candidates(self, joint: str, stop: Callable[[], bool] = lambda: False) -> list[list[Score]] | None:
        """Return a first look at what could be missing at a joint: the best form of each effect, best first.

        Effects whose signatures cannot be told apart in these trials stand together in a list of their own.
        `share` says what a score takes away. The first look is linear; `diagnose` refits and judges what it promises.
        None: `stop`, which is called every second or so, said so.
        """
        frozen = self._frozen(self.stage.fit)
        tried = [one for one in wanted(self.search, self.search.problem, frozen) if one.joints == (joint,)]
        best: dict[str, Score] = {}
        for first in range(0, len(tried), AT_ONCE):
            if stop():
                return None
            for score in screen(self.search.problem, frozen, tried[first : first + AT_ONCE]):
                name = effect_path(score.candidate.effect)
                best[name] = max(score, best.get(name, score), key=lambda one: one.gain)
        ranked = sorted((one for one in best.values() if one.gain > 0.0), key=lambda one: -one.gain)[:RANKED]
        return self._together(ranked, Screen(self.search.problem, frozen)) if ranked else []

    def _together(self, ranked: Sequence[Score], view: Screen) -> list[list[Score]]:
        columns = [column for _, column in view.columns([score.candidate for score in ranked])]
        _, products = view.products(np.stack(columns, axis=-1))
        size = np.sqrt(np.diag(products))
        alike = np.abs(products) >= ALIKE * np.outer(size, size)
        leaders: dict[int, list[Score]] = {}
        for place, score in enumerate(ranked):
            leaders.setdefault(next((k for k in leaders if alike[k, place]), place), []).append(score)
        return list(leaders.values())

    def share(self, score: Score) -> float:
        """Return the part of the squared error on the fitted trials that a candidate would take away."""
        return score.gain / max(self.stage.fit.cost, 1e-12)

    def explainable(self, joint: str) -> float:
        """Return the part of the missing torque that a black box of the logged signals explains: what any law could."""
        return black_box(self.missing(joint), self.seed)

    def unseen(self, joint: str) -> list[Unseen]:
        """Return the effects that no trial could show at a joint, and why."""
        found = unseen(self.search.effects, self.search.shooting.sizes, self.effects)
        return [one for one in found if one.joint == joint]

    @as_input_errors
    def add(self, *names: str) -> ModelStage:
        """Add effects, NAME@JOINT, one after another, each with a refit of everything on the fitted trials.

        Raises:
            InputError: an unknown effect or joint, or one that the model has.
        """
        stages = self.stages
        for name in names:
            for effect, joint in resolve([name], self.recording.joints):
                label = f"{effect_path(effect)}@{joint}"
                if label in [term.label for term in stages[-1].model.terms]:
                    raise InputError(f"{label}: the model has it already")
                if effect not in self.search.effects:
                    raise InputError(f"{label}: name it when the workbench starts, own_effects=[{effect_path(effect)}]")
                self.say(f"refitting with {label}")
                added = with_effect(self.search, self._frozen(stages[-1].fit), effect, joint)
                stages = (*stages, self._stage(f"+ {label}", self.search.refitted(added.model)))
        return self._push(stages)

    def remove(self, label: str) -> ModelStage:
        """Take an effect out and refit everything that is left.

        Raises:
            InputError: the model has no such effect.
        """
        if label not in self.effects:
            raise InputError(f"{label}: the model has only {', '.join(self.effects) or 'its constants'}")
        model = self.stage.fit.model
        less = replace(model, terms=tuple(term for term in model.terms if term.label != label))
        return self._push((*self.stages, self._stage(f"- {label}", self.search.refitted(less))))

    def undo(self) -> bool:
        """Take the last change back; False where there is none."""
        if len(self.history) > 1:
            self.history.pop()
            return True
        return False

    def values(self, joint: str) -> list[Value]:
        """Return the numbers of the model in force at a joint that a fit may change."""
        stage, found = self.stage, []
        units = self.recording.units[joint]
        for unknown, half_width in zip(stage.fit.unknowns, stage.half_width, strict=True):
            if unknown.kind == "constant" and self.recording.joints[unknown.place] == joint:
                key, unit = f"{unknown.key}@{joint}", UNITS[unknown.key]
            elif unknown.kind == "effect" and stage.model.terms[unknown.place].joint == joint:
                term = stage.model.terms[unknown.place]
                unit = next(p.unit for p in term.effect.parameters if p.name == unknown.key)
                key = f"{term.label}.{unknown.key}"
            else:
                continue
            value, low, high = unknown.of(stage.model), unknown.low, unknown.high
            interval = (max(value - half_width, low), min(value + half_width, high)) if half_width else None
            found.append(Value(key, value, interval, of_joint(unit, units), unknown))
        return found

    def set_parameter(self, key: str, value: float) -> ModelStage:
        """Set a number by hand; nothing is refitted. Several in a row are one stage, each undone alone.

        Raises:
            InputError: no such number.
        """
        known = {one.key: one.unknown for joint in self.recording.joints for one in self.values(joint)}
        if key not in known:
            raise InputError(f"{key}: no number of the model; it has {', '.join(known)}")
        model = known[key].put(self.stage.fit.model, value)
        stage = self._stage(BY_HAND, replace(self.stage.fit, model=model), fitted=False)
        stages = self.stages[:-1] if self.stage.label == BY_HAND else self.stages
        return self._push((*stages, stage))

    def propose(self) -> Experiment:
        """Return the commands that would show whether the last effect is there, within the machine's limits.

        Raises:
            InputError: there is no effect to ask about.
        """
        added = [k for k, stage in enumerate(self.stages) if stage.label.startswith("+")]
        if not added:
            raise InputError("add an effect first: an experiment decides between the model with it and without it")
        fits = {stage.label: stage.fit for stage in self.stages[added[-1] - 1 : added[-1] + 1]}
        return next_experiment(self.search.shooting, self.recording, fits, self.search.noise, self.seed, extended=True)

    def diagnose(self, folder: PathLike) -> Diagnosing:
        """Start `diagnose` beside the model in force, in a process of its own; its files go to a folder."""
        model = self.model_file() if self.effects else self.known
        return Diagnosing(self.opened, model, self.own_effects, self.seed, Path(folder))

    @as_input_errors
    def save(self, folder: PathLike) -> ModelFile:
        """Write model.yaml and report.html into a folder, after a refit on all windows of the fitted trials.

        Values set by hand are written as they are, without intervals.
        """
        from tactile_cube.visualization.diagnosis_report import identification_report
        from tactile_cube.visualization.report import write_report

        model, path = self.model_file(), str(Path(folder) / "model.yaml")
        after = compare_recording(without_touches(self.opened), model, USUAL_STEP, floor=self.floor)
        stages = {one.label: one.errors.overall for one in self.stages} | {"noise_floor": self.floor.overall}
        joints = {one.label: one.errors.joints for one in self.stages}
        page = identification_report(after, stages, joints, model.provenance.command, path)
        with written_together(Path(folder), "model.yaml") as aside:
            write_report(page, aside / "report.html")
            write_model(model, aside / "model.yaml")
        return model

    def model_file(self) -> ModelFile:
        """Return the model in force as model.yaml has it: values with intervals, provenance, the error by stage."""
        stage = self.stage
        if stage.half_width.any():
            self.say("refitting on all windows, for the intervals")
            problem = Problem(self.search.shooting, self.search.all_windows)
            fitted = final_fit(problem, stage.fit.model, self.search.unknowns(stage.fit.model))
        else:
            fitted = Fitted(stage.fit.model, stage.fit, stage.half_width, stage.half_width)
        last = self._errors(fitted.model.with_offsets(stage.judgement.model.offsets))[0]
        steps = {"nominal": self.stages[0].errors, "refitted": self.stages[1].errors, "with_effects": last}
        errors = ModelErrors(
            **{key: one.overall for key, one in steps.items()},
            noise_floor=self.floor.overall,
            over_noise=stage.judgement.error,
            joints={key: one.joints for key, one in steps.items()},
        )
        command = COMMAND.format(self.opened.folder)
        model = model_file(self.recording, fitted, errors, self.never_fitted, command, self.seed)
        kept = self.known.object_effects if self.known else []
        return model.model_copy(update={"effects": model.with_effects(kept)})

    def _stage(self, label: str, fit: Fit, fitted: bool = True) -> ModelStage:
        self.say(f"judging: {label}")
        scales = np.array([unknown.scale for unknown in fit.unknowns])
        errors = standard_errors(self.search.problem, fit) if fitted else np.zeros(len(scales))
        judgement = self.search.judged(fit.model)
        model = fit.model.with_offsets(judgement.model.offsets)
        fit = replace(fit, columns=np.zeros(0), residual=np.zeros(0))  # many MB, and taken anew by whoever builds on it
        return ModelStage(label, fit, model, judgement, *self._errors(model), NORMAL_95 * errors * scales)

    def _frozen(self, fit: Fit) -> Fit:
        """A fit with its derivatives, which the first look, a candidate's torque and a refit take alike."""
        if self._kept is not None and self._kept[0] is fit:
            self.search.problem.linearise_starts(fit.model)
        else:
            self._kept = fit, self.search.frozen(fit)
        return self._kept[1]

    def _errors(self, model: Model) -> tuple[ErrorSummary, ErrorSummary]:
        held_out = self.search.held_out
        simulated = free_run(held_out, model, USUAL_STEP)
        raw = raw_residuals(held_out.trials, [one.position for one in simulated])
        return free_run_error(held_out, simulated), summarise_errors(raw, held_out.joints)

    def _as_torque(self, joint: str, residual: Array) -> Missing:
        search = self.search
        found = missing_torques(search.validation, search.held_out, self.stage.judgement.model, residual)
        return found[self.recording.joints.index(joint)]

    def _push(self, stages: tuple[ModelStage, ...]) -> ModelStage:
        self.history = [*self.history[-MOST:], stages]
        return self.stage
