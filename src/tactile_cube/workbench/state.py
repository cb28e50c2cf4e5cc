"""What a workbench holds: a recording, a model that grows effect by effect, and its error after each step.

It needs no browser, and computes only what `compare`, `identify` and `diagnose` compute.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tactile_cube.api.comparison import modelled, opened
from tactile_cube.api.job import PathLike, as_input_errors
from tactile_cube.drivetrain.effects import catalogue, find_effect, import_own_effects, resolve
from tactile_cube.drivetrain.model_file import ModelErrors, ModelFile, write_model
from tactile_cube.errors import InputError
from tactile_cube.identification.diagnosis import Unseen, in_steps, test_errors, unseen
from tactile_cube.identification.disturbances import in_time
from tactile_cube.identification.fitting.gauss_newton import Fit, fit
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.resolution import NORMAL_95, Fitted, standard_errors
from tactile_cube.identification.identification import with_effect
from tactile_cube.identification.model_files import UNITS, model_file
from tactile_cube.identification.next_experiment import Experiment, next_experiment
from tactile_cube.identification.search.candidates import Candidate, Screen, screen
from tactile_cube.identification.search.evidence import Judgement
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.proposals import LOOKED_AT, best_starts, stepped, wanted
from tactile_cube.identification.search.residual_shape import Missing, black_box
from tactile_cube.identification.search.search import some
from tactile_cube.identification.verdict import Simulations
from tactile_cube.measurement.bench import without_touches
from tactile_cube.measurement.comparing.comparison import USUAL_STEP, Comparison, compare_recording, describe_comparison
from tactile_cube.measurement.comparing.error import ErrorSummary
from tactile_cube.measurement.comparing.noise_floor import noise_floor, noise_with_links
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Array, Trial
from tactile_cube.measurement.replay.model import Model, effect_path, nominal_model
from tactile_cube.measurement.replay.simulator import Simulated, free_run
from tactile_cube.measurement.split import held_out_split, with_test_part
from tactile_cube.measurement.units import of_joint
from tactile_cube.whole_file import written_together
from tactile_cube.workbench.background import Diagnosing, Found
from tactile_cube.workbench.missing_torque import missing_torque
from tactile_cube.workbench.parameters import BoundedSearch, Value

STATED, REFITTED, BY_HAND = "stated", "refitted", "by hand"
BEGUN = 2  # stages of a model to which nothing was added: stated, refitted
AT_ONCE = 24  # candidates that are screened before checking whether other work waits
RANKED, LEAST = 10, 0.005  # effects that a look shows, and the share that each takes away at least
ALIKE = 0.95  # correlation of two laws' effects, beside all constants, from which on these trials do not separate them
MOST = 50
"""Changes that can be undone; each keeps a fit and a judgement, some MB."""
COMMAND = "python -m tactile_cube.workbench recording={}"


@dataclass(frozen=True)
class ModelStage:
    """Model after one change, and its error on the untouched trials."""

    label: str  # `stated`, `refitted`, `+ NAME@JOINT`, `- NAME@JOINT` or `by hand`
    fit: Fit  # what it was fitted by; of the stated model, and of values set by hand, the fit that came before
    model: Model  # with the joint offsets of every initialisation
    judgement: Judgement  # on the held-out trials, in segments; the missing torque comes from its residual
    over_noise: float  # error of segments of untouched trials, in units of the sensor noise, as `diagnose` states it
    errors: ErrorSummary  # RMS of free runs there [rad]
    half_width: Array  # (P,) of the fit's unknowns, 95 %; zero where nothing was fitted
    final: Fitted | None = None  # the fit of a diagnosis on all windows, as it is saved


@dataclass(frozen=True)
class Look:
    """Effect added to the model in force, after a few steps of its own parameters."""

    candidate: Candidate  # the effect in the form that does best
    model: Model  # with it
    change: Array  # (G, R) that it makes to the weighted prediction of the windows looked at
    share: float  # part of the squared error there that it takes away

    @property
    def name(self) -> str:
        """Name of the effect."""
        return effect_path(self.candidate.effect)


class Workbench:
    """A recording and a model that is compared with it, extended, and saved; docs/workbench.md has an example."""

    @as_input_errors
    def __init__(
        self,
        recording: Recording | PathLike,
        model: ModelFile | PathLike | None = None,
        own_effects: Sequence[str] = (),
        seed: int = 0,
        say: Callable[[str], None] = lambda line: None,
    ) -> None:
        """Divide the trials as `diagnose` does, which has these arguments, and refit what the model has already.

        Raises:
            InputError: a recording, a model or an effect that cannot be used.
        """
        import_own_effects(list(own_effects))
        self.own_effects, self.seed, self.say, self.known = tuple(own_effects), seed, say, modelled(model)
        self.opened = opened(recording)
        effects = tuple(dict.fromkeys([*catalogue().values(), *(find_effect(name) for name in own_effects)]))
        say("dividing the trials")
        moving = in_time(without_touches(self.opened), effects, say, self.known)
        # free motion, in steps as short as its sensors call for
        self.recording = in_steps(moving, effects, self.known, say)
        fitted, held_out = held_out_split(self.recording, seed=seed)
        fitted, tested = with_test_part(fitted, len(self.recording.trials), seed)
        self.untouched = held_out if tested is None else tested  # what nothing is fitted to and nothing chosen by
        self.search = BoundedSearch(fitted, held_out, noise_with_links(self.recording), effects, say, self.known)
        self.floor = noise_floor(self.recording)  # [rad]
        self._looks: dict[str, Look] = {}
        self.history: list[tuple[ModelStage, ...]] = []  # the stages after each change, the last one in force
        self.base = self.search.base
        stated = self._stage(STATED, replace(self.base.fit, model=self.search.start), fitted=False)
        self._push((stated, self._stage(REFITTED, self.base.fit)))

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
        """Names of the held-out and the untouched trials."""
        return list(dict.fromkeys(t.name for part in (self.search.held_out, self.untouched) for t in part.trials))

    def trial(self, name: str) -> Trial:
        """Return one trial by its name."""
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

    def signature(self, look: Look) -> Missing:
        """Return the torque that an effect supplies; see `missing`."""
        problem = self.search.validation
        added = look.model.with_offsets(self.stage.model.offsets)
        before, after = problem.predictions([replace(added, terms=added.terms[:-1]), added])
        return self._as_torque(look.candidate.joints[0], problem.limited(after - before) * problem.weight)

    def candidates(self, joint: str, stop: Callable[[], bool] = lambda: False) -> list[list[Look]] | None:
        """Return what could be missing at a joint: the best form of each effect that the model has not, best first.

        Every law is fitted beside the frozen model on few windows, as `diagnose` begins. Effects that change the
        prediction alike stand together in a list of their own. None: `stop`, which is called often, said so.
        """
        search, fitted = self.search, self.stage.fit
        problem = Problem(search.shooting, some(search.all_windows, search.segments // LOOKED_AT))
        problem.linearise_starts(fitted.model)
        frozen = fit(problem, fitted.model, fitted.unknowns, iterations=0)
        here = [one for one in wanted(search, problem, frozen) if one.joints == (joint,)]
        tried = [one for one in here if f"{effect_path(one.effect)}@{joint}" not in self.effects]
        scores = []
        for first in range(0, len(tried), AT_ONCE):
            if stop():
                return None
            scores += screen(problem, frozen, tried[first : first + AT_ONCE])
        best: dict[str, Look] = {}
        for candidate in best_starts(sorted(scores, key=lambda score: -score.gain)):
            if stop():
                return None
            _, found = stepped(problem, frozen, candidate)
            share = 1.0 - found.cost / max(frozen.cost, 1e-12)
            look = Look(candidate, found.model, frozen.residual - found.residual, share)
            best[look.name] = max(look, best.get(look.name, look), key=lambda one: one.share)
        ranked = sorted((one for one in best.values() if one.share >= LEAST), key=lambda one: -one.share)[:RANKED]
        self._looks |= {f"{one.name}@{joint}": one for one in ranked}
        return _together(ranked, Screen(problem, frozen)) if ranked else []

    def promised(self, look: Look) -> float:
        """Return the error over noise that an effect leaves on the untouched trials, with all else as it is."""
        return self._tested(look.model)[1]

    def explainable(self, joint: str) -> float:
        """Return the part of the missing torque that a black box of the logged signals explains: what any law could."""
        return black_box(self.missing(joint), self.seed)

    def unseen(self, joint: str) -> list[Unseen]:
        """Return the effects that no trial could show at a joint, and why."""
        found = unseen(self.search.effects, self.search.shooting.sizes, self.effects)
        return [one for one in found if one.joint == joint]

    @as_input_errors
    def add(self, *names: str) -> ModelStage:
        """Add effects that the model has not, NAME@JOINT, each with a refit of everything on the fitted trials."""
        stages = self.stages
        for effect, joint in (one for name in names for one in resolve([name], self.recording.joints)):
            label = f"{effect_path(effect)}@{joint}"
            if label in [term.label for term in stages[-1].model.terms]:
                raise InputError(f"{label}: the model has it already")
            if effect not in self.search.effects:
                raise InputError(f"{label}: name it when the workbench starts, own_effects=[{effect_path(effect)}]")
            self.say(f"refitting with {label}")
            if stages is self.stages and label in self._looks:
                added = self._looks[label].model
            else:
                added = with_effect(self.search, self.search.frozen(stages[-1].fit), effect, joint).model
            stages = (*stages, self._refitted(f"+ {label}", added))
        return self._push(stages)

    def adopt(self, found: Found) -> ModelStage:
        """Take the model that a diagnosis recommends, as it is."""
        after, before = [term.label for term in found.fitted.model.terms], self.effects
        changes = [f"+ {one}" for one in after if one not in before]
        changes += [f"- {one}" for one in before if one not in after]
        stage = self._stage(" ".join(changes) or REFITTED, found.fitted.fit, final=found.fitted)
        return self._push((*self.stages, stage))

    def remove(self, label: str) -> ModelStage:
        """Take an effect that the model has out and refit everything that is left."""
        if label not in self.effects:
            raise InputError(f"{label}: the model has only {', '.join(self.effects) or 'its constants'}")
        model = self.stage.fit.model
        less = replace(model, terms=tuple(term for term in model.terms if term.label != label))
        return self._push((*self.stages, self._refitted(f"- {label}", less)))

    def refit(self) -> ModelStage:
        """Refit everything that is not fixed, from the values in force."""
        return self._push((*self.stages, self._refitted(REFITTED, self.stage.fit.model)))

    def undo(self) -> bool:
        """Take the last change back; False where there is none."""
        if len(self.history) > 1:
            self.history.pop()
            self._looks = {}
            return True
        return False

    def values(self, joint: str) -> list[Value]:
        """Return the numbers of the model in force at a joint that a fit may change."""
        search, model, fit, found = self.search, self.stage.model, self.stage.fit, []
        widths = {search.key(u, model): w for u, w in zip(fit.unknowns, self.stage.half_width, strict=True)}
        for key, unknown in search.numbers(model).items():
            if unknown.kind == "constant":
                at, unit = self.recording.joints[unknown.place], UNITS[unknown.key]
            else:
                term = model.terms[unknown.place]
                at, unit = term.joint, next(p.unit for p in term.effect.parameters if p.name == unknown.key)
            if at == joint:
                value, width = unknown.of(model), 0.0 if search.fixed(key) else widths.get(key, 0.0)
                interval = (max(value - width, unknown.low), min(value + width, unknown.high)) if width else None
                unit = of_joint(unit, self.recording.units[joint])
                found.append(Value(key, value, interval, unit, unknown, search.fixed(key)))
        return found

    def set_parameter(self, key: str, value: float) -> ModelStage:
        """Set a number by hand; nothing is refitted. Several in a row are one stage, each undone alone."""
        known = self.search.numbers(self.stage.model)
        if key not in known:
            raise InputError(f"{key}: no number of the model; it has {', '.join(known)}")
        model = known[key].put(self.stage.fit.model, value)
        stage = self._stage(BY_HAND, replace(self.stage.fit, model=model), fitted=False)
        return self._push((*(self.stages[:-1] if self.stage.label == BY_HAND else self.stages), stage))

    def bound(self, key: str, low: float, high: float) -> None:
        """Keep a number within bounds that it may have at every refit from now on; both alike fix it."""
        self.search.bound(self.stage.model, key, low, high)

    def propose(self) -> Experiment:
        """Return the commands that would show whether the effect added last is there, within the machine's limits."""
        added = [k for k, stage in enumerate(self.stages) if stage.label.startswith("+")]
        if not added:
            raise InputError("add an effect first: an experiment decides between the model with it and without it")
        fits = {stage.label: stage.fit for stage in self.stages[added[-1] - 1 : added[-1] + 1]}
        return next_experiment(self.search.shooting, self.recording, fits, self.search.noise, self.seed, extended=True)

    def diagnose(self, folder: PathLike) -> Diagnosing:
        """Start `diagnose` beside what was added or set so far, in a process of its own; its files go to a folder."""
        model = self.known if len(self.stages) == BEGUN else self.model_file()
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
        fitted = stage.final or Fitted(stage.fit.model, stage.fit, stage.half_width, stage.half_width)
        if stage.final is None and stage.half_width.any():
            self.say("refitting on all windows, for the intervals")
            explanation = Explanation((), stage.fit, stage.judgement, 1.0, 0.0)
            fitted = Simulations(self.search, self.base, self.floor).final(explanation)
        last, over_noise = self._tested(fitted.model)
        steps = {"nominal": self.stages[0].errors, "refitted": self.stages[1].errors, "with_effects": last}
        errors = ModelErrors(
            **{key: one.overall for key, one in steps.items()},
            noise_floor=self.floor.overall,
            over_noise=over_noise,
            joints={key: one.joints for key, one in steps.items()},
        )
        command = COMMAND.format(self.opened.folder)
        model = model_file(self.recording, fitted, errors, self.never_fitted, command, self.seed)
        kept = self.known.object_effects if self.known else []
        return model.model_copy(update={"effects": model.with_effects(kept)})

    def _refitted(self, label: str, model: Model) -> ModelStage:
        return self._stage(label, self.search.refitted(self.search.within_bounds(model)))

    def _stage(self, label: str, fit: Fit, fitted: bool = True, final: Fitted | None = None) -> ModelStage:
        self.say(f"judging: {label}")
        half_width = np.zeros(len(fit.unknowns))
        if final is not None:
            half_width = final.half_width
        elif fitted:
            half_width = NORMAL_95 * standard_errors(self.search.problem, fit) * [one.scale for one in fit.unknowns]
        judgement = self.search.judged(fit.model)
        model = fit.model.with_offsets(judgement.model.offsets)
        model = model.with_offsets(nominal_model(self.untouched, self.known).offsets)
        fit = replace(fit, columns=np.zeros(0), residual=np.zeros(0))  # many MB, and computed anew where needed
        errors, over_noise = self._tested(fit.model)
        return ModelStage(label, fit, model, judgement, over_noise, errors, half_width, final)

    def _tested(self, model: Model) -> tuple[ErrorSummary, float]:
        """Return the errors of free runs of the untouched trials [rad], and of their segments over the sensor noise."""
        errors, over_noise = test_errors(self.search, self.untouched, {"": model}, USUAL_STEP)
        return errors[""], over_noise[""]

    def _as_torque(self, joint: str, residual: Array) -> Missing:
        search, model = self.search, self.stage.judgement.model
        noise = float(search.noise[self.recording.joints.index(joint)])
        return missing_torque(search.validation, search.held_out, model, residual, joint, noise)

    def _push(self, stages: tuple[ModelStage, ...]) -> ModelStage:
        self.history = [*self.history[-MOST:], stages]
        self._looks = {}
        return self.stage


def _together(ranked: Sequence[Look], view: Screen) -> list[list[Look]]:
    """Group the looks that change the prediction alike, apart from what constants can change."""
    _, products = view.products(np.stack([look.change for look in ranked], axis=-1))
    size = np.sqrt(np.diag(products))
    alike = np.abs(products) >= ALIKE * np.outer(size, size)
    leaders: dict[int, list[Look]] = {}
    for place, look in enumerate(ranked):
        leaders.setdefault(next((k for k in leaders if alike[k, place]), place), []).append(look)
    return list(leaders.values())
