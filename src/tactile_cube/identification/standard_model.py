"""The field's standard model of a drive, fitted in seconds: the first answer, which a search has to beat.

Torque constant, mass, rotor inertia, viscous and Coulomb friction of every joint, beside the constants that its owner
states; then offset of the torque and friction by direction. All are expected where they are stated.

Source: Gautier, Dynamic identification of robots with power model, ICRA 1997 (the model). Ribeiro et al., On the
smoothness of nonlinear system identification, Automatica 121, 2020 (windows that grow). Janot, Gautier, Brunot, EMPS
benchmark, 2019 (friction by direction).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.effects.effect import Array, Effect, Scales
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.fitting.gauss_newton import Fit, fit
from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.identification.fitting.resolution import NORMAL_95, needless, standard_errors
from tactile_cube.identification.fitting.unknowns import base_unknowns, every_effect
from tactile_cube.identification.search.candidates import Candidate, model_unknowns
from tactile_cube.identification.search.evidence import HeldOut
from tactile_cube.identification.search.explanation import Proposal
from tactile_cube.identification.search.search import some
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, Term, nominal_model
from tactile_cube.measurement.replay.windows import Windows, between_steps
from tactile_cube.measurement.units import milli

WINDOWS = (0.05, 0.2, 1.0, 4.0)  # [s] of a finger: short windows for poor start values, long ones for slow effects
FEWEST_ROWS = 8
LONGEST_FITTED = 24.0  # [s] of a finger by the number of joints: enough data for a first answer
ROUNDS, ITERATIONS = 2, 6  # of the robust weights in windows of one length; Gauss-Newton steps in each
OUTLYING = 2.0  # robust standard deviations from which on an error counts in proportion, not squared
NORMAL_MEDIAN = 0.6745  # median of the absolute value of a standard normal number
Laws = Mapping[str, tuple[str, ...]]  # effect -> parameters that are fitted
PLAIN: Laws = {
    "torque_gain": ("error",),
    "payload": ("mass",),
    "reflected_inertia": ("excess",),
    "viscous_friction": ("damping",),
    "coulomb_friction": ("friction",),
}
IN_PROPORTION = ("payload", "reflected_inertia")
"""Effects that change nothing in proportion with a torque constant: as stated unless held-out trials need them."""
BY_DIRECTION: Laws = {
    "viscous_friction": ("damping", "difference"),
    "asymmetric_friction": ("difference",),
    "torque_bias": ("bias",),
}


def spreads(scales: Scales) -> dict[str, float]:
    """Return the standard deviation of each parameter about its stated value.

    Masses are measured on scales, torque constants and rotors come from data sheets, friction is a share of the torque.
    """
    torque, damping = scales.torque, scales.torque / scales.speed
    return {
        "torque_gain.error": 0.3,
        "payload.mass": 0.05 * scales.mass,
        "reflected_inertia.excess": 0.3 * scales.inertia,
        "viscous_friction.damping": 0.5 * damping,
        "viscous_friction.difference": 0.1 * damping,
        "coulomb_friction.friction": 0.3 * torque,
        "asymmetric_friction.difference": 0.05 * torque,
        "torque_bias.bias": 0.05 * torque,
    }


@dataclass(frozen=True)
class Tried:
    """A model that was tried.

    Attributes:
        model: with those effects that are found otherwise than stated; what is stated where no fit was better.
        error: RMS of free runs of the held-out trials [rad].
        rows: of the windows in which it was fitted.
        fit: on the trials to fit, in the windows that did best; None where no fit was better.
        half_width: (P,) of the 95 % interval of each of the fit's unknowns.
    """

    model: Model
    error: float
    rows: int = 0
    fit: Fit | None = field(default=None, repr=False)
    half_width: Array = field(default_factory=lambda: np.zeros(0), repr=False)


@dataclass(frozen=True, kw_only=True)
class StandardModel(Tried):
    """Fitted standard model.

    Attributes:
        effects: those of the model, each at one joint.
        stated_error: the error as stated [rad].
    """

    effects: tuple[Candidate, ...]
    stated_error: float

    @property
    def proposal(self) -> Proposal | None:
        """Its effects as a set for the search; None without any."""
        return Proposal(self.effects, self.fit) if self.fit and self.effects else None

    @property
    def otherwise(self) -> tuple[str, ...]:
        """Effects that are found otherwise than stated, NAME@JOINT: their intervals leave out what changes nothing."""
        if self.fit is None:
            return ()
        first = len(self.model.terms) - len(self.effects)
        sure = {
            u.place
            for u, width in zip(self.fit.unknowns, self.half_width, strict=True)
            if u.kind == "effect" and abs(u.of(self.model) - u.neutral) / max(float(width), np.finfo(float).tiny) > 1.0
        }
        return tuple(t.label for k, t in enumerate(self.model.terms) if k >= first and k in sure)

    def sentence(self, unit: str) -> str:
        """Return the first result as a line for the terminal; `unit` of the positions: rad or m."""
        stated = f"held-out error {milli(self.stated_error, unit)} as stated"
        if self.fit is None:
            return f"{stated}; the standard model does no better"
        named = f"{', '.join(self.otherwise)} otherwise" if self.otherwise else "nothing otherwise than stated"
        return f"{stated}, standard model {milli(self.error, unit)} ({named}); the search has to beat it"


def fit_standard_model(
    fitted: Recording,
    held_out: Recording,
    noise: Array,
    known: ModelFile | None = None,
    effects: Sequence[type[Effect]] = (),
) -> StandardModel:
    """Fit the standard model; nothing is taken that does worse on the held-out trials than what went before.

    Args:
        fitted: trials to fit.
        held_out: trials to judge by.
        noise: (n,) or (2 n,) of the position sensors [rad].
        known: the model to begin with; None: what the recording's owner states.
        effects: classes to compile in; their kernel is used again by a search for them.
    """
    start = nominal_model(fitted, known)
    shooting = Shooting(fitted, every_effect(effects, start))
    judge = HeldOut(shooting, held_out, noise, nominal_model(held_out, known).offsets)
    return _Fitting(fitted, noise, start, shooting, judge).run()


@dataclass(frozen=True)
class _Fitting:
    """The trials to fit and those to judge by, and the models that are tried one after another."""

    recording: Recording
    noise: Array
    start: Model
    shooting: Shooting
    judge: HeldOut

    def run(self) -> StandardModel:
        """Fit the plain model in growing windows, add laws by direction if better, then remove effects not needed."""
        stated = best = Tried(self.start, self.judge.error(self.start))
        for laws, gain in ((PLAIN, 0.0), (BY_DIRECTION, STANDARD.detail)):
            best = self.grown(best, laws, gain)
        best = self.needed(best) if best.fit else best
        return StandardModel(**vars(best), effects=self.added(best.model), stated_error=stated.error)

    def grown(self, before: Tried, laws: Laws, gain: float) -> Tried:
        """Fit these laws too, in growing windows or those of the previous fit; return that fit if none is better."""
        best, model = before, before.model
        for name, parameters in laws.items():
            for joint in self.recording.joints:
                model = with_law(model, find_effect(name), joint, parameters, self.shooting.sizes[joint])
        longest = max(len(trial.time) for trial in self.recording.trials)
        growing = [self.rows_of(seconds) for seconds in WINDOWS]
        lengths = [before.rows] if before.rows else growing
        for rows in dict.fromkeys(min(max(length, FEWEST_ROWS), longest) for length in lengths):
            tried = self.robust(model, rows)
            if tried.error**2 < (1.0 - gain) * before.error**2 and tried.error < best.error:
                best = tried
            model = tried.model
        return best

    def rows_of(self, seconds: float) -> int:
        """Return the rows of a window of about so many seconds at a finger, scaled to the machine's time."""
        rows = round(seconds * self.shooting.time / self.recording.step)
        return between_steps(self.recording.trials, rows, self.shooting.time)

    def robust(self, model: Model, rows: int, rounds: int = ROUNDS) -> Tried:
        """Fit in windows of so many rows with a soft-L1 loss, by iterative reweighting."""
        segments = max(
            1, round(LONGEST_FITTED * self.shooting.time / (len(self.recording.joints) * rows * self.recording.step))
        )
        windows = some(self.shooting.cut(self.recording, self.noise, segment=rows), segments)
        sizes = self.shooting.sizes
        unknowns = (*base_unknowns(self.recording, self.start.constants, sizes), *model_unknowns(model, sizes))
        for _ in range(rounds):
            problem = self.weighted(windows, model)
            found = fit(problem, model, unknowns, ITERATIONS)
            model = found.model
        half_width = NORMAL_95 * standard_errors(problem, found) * np.array([u.scale for u in unknowns])
        return Tried(model, self.judge.error(model), rows, found, half_width)

    def weighted(self, windows: Windows, model: Model) -> Problem:
        """Return the problem of windows, weighted by a soft-L1 loss of a model's errors."""
        problem = Problem(self.shooting, windows)
        error = np.abs(problem.limited(problem.measured - problem.predictions([model])[0]))
        weight = windows.weight * np.sqrt(soft_l1(error, problem.weight)).reshape(windows.weight.shape)
        problem = Problem(self.shooting, replace(windows, weight=weight))
        problem.linearise_starts(model)
        return problem

    def needed(self, best: Tried) -> Tried:
        """Remove the effects that are as stated, then those in proportion with a torque constant."""
        assert best.fit is not None, "what is stated has nothing to take out"
        best = self.without(best, self.needless(best))
        plain = {t.label for t in best.model.terms[len(self.start.terms) :] if t.effect.name in IN_PROPORTION}
        fewer = self.without(best, plain)
        return self.without(fewer, self.needless(fewer)) if fewer is not best else best

    def needless(self, tried: Tried) -> set[str]:
        """Return the added effects that are as stated."""
        assert tried.fit is not None, "what is stated has no covariance"
        terms = tried.model.terms
        return {terms[k].label for k in needless(tried.model, tried.fit, tried.half_width, len(self.start.terms))}

    def without(self, best: Tried, labels: set[str]) -> Tried:
        """Refit the model without some effects; return it unchanged if that is worse."""
        if not labels:
            return best
        first = len(self.start.terms)
        terms = tuple(t for k, t in enumerate(best.model.terms) if k < first or t.label not in labels)
        near = self.robust(replace(best.model, terms=terms), min(self.rows_of(WINDOWS[1]), best.rows))
        fewer = min(near, self.robust(near.model, best.rows, 1), key=lambda one: one.error)
        return fewer if fewer.error**2 <= (1.0 + STANDARD.detail) * best.error**2 else best

    def added(self, model: Model) -> tuple[Candidate, ...]:
        """Return the effects of a model that the start model does not have."""
        return tuple(
            Candidate(t.effect, (t.joint,), {key: t.values[key] for key in t.fitted}, self.shooting.sizes)
            for t in model.terms[len(self.start.terms) :]
        )


def with_law(model: Model, effect: type[Effect], joint: str, parameters: tuple[str, ...], scales: Scales) -> Model:
    """Return the model with parameters of an effect free, expected as stated and neutral where they are new."""
    own = effect.parameters_at(scales)
    expected = {key: (own[key].neutral, spreads(scales)[f"{effect.name}.{key}"]) for key in parameters}
    for place, term in enumerate(model.terms):
        if (term.effect, term.joint) == (effect, joint):
            fitted = tuple(dict.fromkeys((*term.fitted, *parameters)))
            more = replace(term, fitted=fitted, expected={**expected, **term.expected})
            return replace(model, terms=(*model.terms[:place], more, *model.terms[place + 1 :]))
    values = {key: p.neutral for key, p in own.items()}
    values |= {"distance": scales.lever} if "distance" in own and not scales.slides else {}
    return replace(model, terms=(*model.terms, Term(effect, joint, values, parameters, expected)))


def soft_l1(error: Array, weight: Array) -> Array:
    """Return the weights (G, R) of squared errors (G, R) in a soft-L1 loss, whose width follows most of the errors.

    Errors of no weight (G, R) count in nothing.
    Source: Huber, Robust Statistics, 1981; the loss is scipy.optimize.least_squares'.
    """
    seen = weight > 0.0
    middle = float(np.median(error[seen])) / NORMAL_MEDIAN if seen.any() else 0.0
    width = OUTLYING * max(middle, float(1.0 / weight.max()) if seen.any() else 1.0)
    return np.asarray(1.0 / np.sqrt(1.0 + (error / width) ** 2))
