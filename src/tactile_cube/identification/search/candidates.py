"""Candidates: every effect in every form, and models with effects added, removed or refined."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tactile_cube.drivetrain.effects.effect import FINGER, Array, Effect, Parameter, Scales
from tactile_cube.identification.fitting.gauss_newton import Fit, noise_inflation, precision
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.measurement.replay.model import Model, Term

EffectClass = type[Effect]
Sizes = Mapping[str, Scales]  # joint -> its sizes; a joint that is not there counts as a finger's
UNKNOWN = (0.0, math.inf)  # centre and standard deviation of a number of which nothing is known
MOST_SHOWN = 4  # fitted parameters that a label lists
NO_SIZE = 1e6  # a limit so far off, in the units of a finger, is none


@dataclass(frozen=True)
class Candidate:
    """One effect in one form at one or more joints.

    Attributes:
        effect: its class.
        joints: where it acts.
        form: parameters that are fitted, and their starts at the first joint; at others as much of their size.
        sizes: of the joints.
    """

    effect: EffectClass
    joints: tuple[str, ...]
    form: Mapping[str, float]
    sizes: Sizes = field(default_factory=dict, repr=False, compare=False)

    @property
    def label(self) -> str:
        """Readable and unique: `backlash(play)@q2`."""
        fitted = ", ".join(self.form) if len(self.form) <= MOST_SHOWN else f"{len(self.form)} values"
        return f"{self.effect.name}({fitted})@{'+'.join(self.joints)}"

    @property
    def size(self) -> int:
        """Fitted numbers."""
        return len(self.form) * len(self.joints)

    def parameters(self, joint: str) -> dict[str, Parameter]:
        """Return all parameters of the effect with their sizes at a joint."""
        return self.effect.parameters_at(self.sizes.get(joint, FINGER))

    def start(self, joint: str) -> dict[str, float]:
        """Return the start values of the form at a joint."""
        here, first = (self.sizes.get(one, FINGER) for one in (joint, self.joints[0]))
        units = {p.name: p.unit for p in self.effect.parameters}
        return {name: value * here.of(units[name]) / first.of(units[name]) for name, value in self.form.items()}

    def added_to(self, model: Model) -> tuple[Model, tuple[Unknown, ...]]:
        """Return the model with the effect at its start, and the unknowns of the effect."""
        terms = [self._term(joint) for joint in self.joints]
        first = len(model.terms)
        unknowns = tuple(u for k, term in enumerate(terms) for u in term_unknowns(term, first + k, self.sizes))
        return replace(model, terms=(*model.terms, *terms)), unknowns

    def _term(self, joint: str) -> Term:
        scales = self.sizes.get(joint, FINGER)
        neutral = {name: p.neutral for name, p in self.parameters(joint).items()}
        values = neutral | self.effect.placed_at(scales) | self.start(joint)
        return Term(self.effect, joint, values, tuple(self.form))


def term_unknowns(term: Term, place: int, sizes: Sizes | None = None) -> tuple[Unknown, ...]:
    """Return the unknowns of a term; a parameter without a scale is scaled by the size of its value."""
    joint = (sizes or {}).get(term.joint, FINGER)
    parameters = term.effect.parameters_at(joint)
    known = {name: abs(term.values[name]) for name in term.fitted}
    far = {n: p.neutral != 0.0 and known.get(n, 0.0) >= NO_SIZE * joint.of(p.unit) for n, p in parameters.items()}
    known = {n: 0.0 if far[n] else size for n, size in known.items()}
    scales = {name: known[name] or abs(parameters[name].typical) for name in term.fitted}
    fallback = max([size for size in scales.values() if size > 0.0], default=1.0)
    return tuple(
        Unknown(
            "effect",
            name,
            place,
            p.low,
            p.high,
            p.scale or scales[name] or fallback,
            neutral=p.neutral,
            centre=term.expected.get(name, UNKNOWN)[0],
            spread=term.expected.get(name, UNKNOWN)[1],
        )
        for name, p in ((name, parameters[name]) for name in term.fitted)
    )


def model_unknowns(model: Model, sizes: Sizes | None = None) -> tuple[Unknown, ...]:
    """Return the unknowns of all effects of a model."""
    return tuple(u for place, term in enumerate(model.terms) for u in term_unknowns(term, place, sizes))


def candidates(sizes: Sizes, effects: Sequence[EffectClass]) -> list[Candidate]:
    """Return every effect in every form at each joint where it can act, except forms started from the residual."""
    return [
        Candidate(effect, (joint,), start, sizes)
        for effect in effects
        for joint, scales in sizes.items()
        if effect.can_act(scales)
        for start in effect.starts_at(scales)
        if not set(effect.from_residual) & set(start)
    ]


def with_details(candidate: Candidate, model: Model) -> tuple[Candidate, Model, tuple[Unknown, ...]] | None:
    """Free the details of the law of a fitted model's last effect; return candidate, model and unknowns.

    Return None if the law has no identifiable details beyond those already fitted.
    """
    first = len(model.terms) - len(candidate.joints)
    scales = candidate.sizes.get(candidate.joints[0], FINGER)
    told = candidate.effect.details_at(scales, model.terms[first].values)
    details = [name for name in told if name not in candidate.form]
    if not details:
        return None
    neutral = {name: p.neutral for name, p in candidate.parameters(candidate.joints[0]).items() if name in details}
    begun = {name: start for name, start in candidate.effect.detail_starts.items() if name in details}
    terms = [replace(t, values={**t.values, **begun}, fitted=(*t.fitted, *details)) for t in model.terms[first:]]
    unknowns = [u for k, term in enumerate(terms) for u in term_unknowns(term, first + k, candidate.sizes)]
    detailed = replace(candidate, form={**candidate.form, **neutral})
    return detailed, replace(model, terms=(*model.terms[:first], *terms)), tuple(unknowns)


def first_term(model: Model, effects: Sequence[Candidate], place: int) -> int:
    """Return the index of an effect's first term in a model whose last terms are those of `effects`."""
    known = len(model.terms) - sum(len(candidate.joints) for candidate in effects)
    return known + sum(len(candidate.joints) for candidate in effects[:place])


def without_effect(model: Model, effects: Sequence[Candidate], place: int) -> Model:
    """Return a fitted model, whose last terms are those of `effects`, without one of these effects."""
    first = first_term(model, effects, place)
    return replace(model, terms=(*model.terms[:first], *model.terms[first + len(effects[place].joints) :]))


BATCH = 24  # candidates simulated at once, which bounds the memory


@dataclass(frozen=True)
class Score:
    """How a candidate at finite values looks from the base model.

    Attributes:
        candidate: the effect, form, joint and values.
        gain: squared error that it would explain to first order, in units of the sensor's variance.
        factor: best multiple of the effect to first order.
    """

    candidate: Candidate
    gain: float
    factor: float


class Screen:
    """The base fit's residual and columns, with the segments' starts and the base constants projected out."""

    def __init__(self, problem: Problem, base: Fit) -> None:
        self.problem = problem
        self.base = base
        self.prediction = problem.windows.by_segment(problem.path(base.model).position)
        self.residual = problem.free(problem.residual(self.prediction))
        self.free_columns = problem.free(base.columns)
        expected = noise_inflation(problem, base.cost) * precision(base.unknowns)
        self.information = base.information + np.diag(expected)
        offset = [(u.of(base.model) - u.centre) / u.scale for u in base.unknowns]
        self.gradient = np.einsum("grp,gr->p", base.columns, self.residual, optimize=True) - expected * np.array(offset)

    def columns(self, wanted: Sequence[Candidate]) -> Iterator[tuple[Candidate, Array]]:
        """Yield each candidate with the change of the weighted prediction (G, R) at its start."""
        for first in range(0, len(wanted), BATCH):
            part = wanted[first : first + BATCH]
            models = [candidate.added_to(self.base.model)[0] for candidate in part]
            predictions = self.problem.predictions(models, self.base.model)
            for candidate, prediction in zip(part, predictions, strict=True):
                yield candidate, self.problem.limited(prediction - self.prediction) * self.problem.weight

    def alone(self, column: Array) -> tuple[float, float, float]:
        """Return the gradient of a column, its size beside the base columns, and its size without them."""
        gradient, gram = self.products(column[..., None])
        return float(gradient[0]), float(gram[0, 0]), float(np.sum(column * self.problem.free(column)))

    def products(self, columns: Array) -> tuple[Array, Array]:
        """Return the gradient (C,) and products (C, C) of columns (G, R, C), with the base columns projected out."""
        cross = np.einsum("grp,grc->pc", self.free_columns, columns, optimize=True)
        solved = np.linalg.solve(self.information, cross)
        gram = np.einsum("grc,grd->cd", columns, self.problem.free(columns), optimize=True) - cross.T @ solved
        gradient = np.einsum("grc,gr->c", columns, self.residual, optimize=True) - solved.T @ self.gradient
        return np.asarray(gradient), np.asarray(gram)


def screen(problem: Problem, base: Fit, wanted: Sequence[Candidate]) -> list[Score]:
    """Return the scores of candidates at their starts by what they explain of a fit's residual, best first."""
    view, scores = Screen(problem, base), []
    for candidate, column in view.columns(wanted):
        gradient, left, size = view.alone(column)
        factor = gradient / left if left > 1e-6 * size and size > 1e-3 else 0.0
        scores.append(Score(candidate, factor * gradient, factor))
    return sorted(scores, key=lambda score: -score.gain)


RESIZED = (0.2, 6.0)  # factors of the first look that are believed
AS_GOOD = 0.95  # share of the best first-order gain from which on a start of the same law looks as good


def start(same: Sequence[Score]) -> Score:
    """Return, of a law's starts (best first) with about the best gain, the one nearest to the estimated size.

    A start that must grow six times, such as a small mass in a search for a large one, is extrapolated too far.
    """
    return min(
        (score for score in same if score.gain >= AS_GOOD * same[0].gain),
        key=lambda score: abs(math.log(abs(factor))) if (factor := believed(score)) else math.inf,
    )


def believed(score: Score) -> float:
    """Return what the first look multiplies a start with, within the law's bounds; 0 against its sign.

    Only a law whose size is one parameter may have its sign changed.
    """
    if (name := size_of(score.candidate)) is None:
        return max(score.factor, 0.0)
    begun, known = score.candidate.form[name], score.candidate.parameters(score.candidate.joints[0])[name]
    return min(max(score.factor * begun, known.low), known.high) / begun


def size_of(candidate: Candidate) -> str | None:
    """Return the one parameter that sets a law's size; others may set a position or a speed, neutral at no zero."""
    parameters, (name, *more) = candidate.parameters(candidate.joints[0]), candidate.form
    alone = parameters[name].neutral == 0.0 and all(parameters[one].neutral != 0.0 for one in more)
    return name if alone else None


def resized(score: Score) -> Candidate:
    """Return the candidate with its start scaled to the screening's estimate, if one parameter sets the size."""
    name, factor = size_of(score.candidate), believed(score)
    if name is None or not RESIZED[0] < abs(factor) < RESIZED[1]:
        return score.candidate
    form = score.candidate.form
    return replace(score.candidate, form={**form, name: factor * form[name]})
