"""A first look: how much of a residual candidates could explain, alone or a few together, and which to refit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.gauss_newton import Fit, noise_inflation, precision
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.search.candidates import Candidate

Array = NDArray[np.float64]
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
        self.prediction = problem.predictions([base.model])[0]
        self.residual = problem.free(problem.residual(self.prediction))
        self.free_columns = problem.free(base.columns)
        expected = noise_inflation(problem, base.cost) * precision(base.unknowns)
        self.information = base.information + np.diag(expected)
        offset = [(u.of(base.model) - u.centre) / u.scale for u in base.unknowns]
        self.gradient = np.einsum("grp,gr->p", base.columns, self.residual, optimize=True) - expected * np.array(offset)

    def columns(self, wanted: Sequence[Candidate]) -> Iterator[tuple[Candidate, Array]]:
        """Each candidate with the change of the weighted prediction (G, R) that it makes at its start."""
        for first in range(0, len(wanted), BATCH):
            part = wanted[first : first + BATCH]
            predictions = self.problem.predictions([candidate.added_to(self.base.model)[0] for candidate in part])
            for candidate, prediction in zip(part, predictions, strict=True):
                yield candidate, self.problem.limited(prediction - self.prediction) * self.problem.weight

    def alone(self, column: Array) -> tuple[float, float, float]:
        """Gradient of a column, its size beside the base columns, and its size without them."""
        gradient, gram = self.products(column[..., None])
        return float(gradient[0]), float(gram[0, 0]), float(np.sum(column * self.problem.free(column)))

    def products(self, columns: Array) -> tuple[Array, Array]:
        """Gradient (C,) and products (C, C) of columns (G, R, C), with the base columns projected out."""
        cross = np.einsum("grp,grc->pc", self.free_columns, columns, optimize=True)
        solved = np.linalg.solve(self.information, cross)
        gram = np.einsum("grc,grd->cd", columns, self.problem.free(columns), optimize=True) - cross.T @ solved
        gradient = np.einsum("grc,gr->c", columns, self.residual, optimize=True) - solved.T @ self.gradient
        return np.asarray(gradient), np.asarray(gram)


def screen(problem: Problem, base: Fit, wanted: Sequence[Candidate]) -> list[Score]:
    """Scores of candidates at their starts, best first.

    Args:
        problem: windows to look at.
        base: fit whose residual is to be explained.
        wanted: candidates.
    """
    view, scores = Screen(problem, base), []
    for candidate, column in view.columns(wanted):
        gradient, left, size = view.alone(column)
        factor = gradient / left if left > 1e-6 * size and size > 1e-3 else 0.0
        scores.append(Score(candidate, factor * gradient, factor))
    return sorted(scores, key=lambda score: -score.gain)


VARIANTS = 1  # further forms or places of these effects that come along
RESIZED = (0.2, 6.0)  # factors of the first look that are believed
UNDERRATED = 8.0  # times that a refit may explain more than the first look
AS_GOOD = 0.95  # share of the best first-order gain from which on a start of the same law looks as good
PROMISING = 0.03  # share of the best first-order gain that a candidate needs to be refitted


def with_groups(scores: Sequence[Score], needed: float) -> list[Candidate]:
    """Candidates worth a refit, best first; an effect that helps at several joints also stands for all of them.

    None where even the best of them is far from taking as much off the squared error as is `needed`.
    """
    starts: dict[tuple[str, tuple[str, ...], tuple[str, ...]], list[Score]] = {}
    for score in scores:
        key = (score.candidate.effect.name, tuple(score.candidate.form), score.candidate.joints)
        starts.setdefault(key, []).append(score)
    best = {key: start(same) for key, same in starts.items()}
    ranked = [(score.gain, resized(score)) for score in best.values() if score.gain > 0.0]
    families: dict[tuple[str, tuple[str, ...]], list[Score]] = {}
    for (name, form, _), score in best.items():
        families.setdefault((name, form), []).append(score)
    for members in families.values():
        useful = [m for m in members if m.gain > 0.0]
        if len(useful) > 1 and sum(m.gain for m in useful) > 1.3 * max(m.gain for m in useful):
            first = useful[0].candidate
            joints = tuple(m.candidate.joints[0] for m in useful)
            ranked.append((sum(m.gain for m in useful), replace(first, joints=joints)))
    ranked.sort(key=lambda pair: -pair[0])
    most = ranked[0][0] if ranked else 0.0
    if UNDERRATED * most < needed:
        return []
    return [candidate for gained, candidate in ranked if gained > PROMISING * most]


def start(same: Sequence[Score]) -> Score:
    """Of starts of one law, best first, the one that is nearest to its size among those that look as good as the best.

    What has to become six times as large, as a small mass where a large one is meant, is extrapolated too far.
    """
    return min(
        (score for score in same if score.gain >= AS_GOOD * same[0].gain),
        key=lambda score: abs(math.log(score.factor)) if score.factor > 0.0 else math.inf,
    )


def resized(score: Score) -> Candidate:
    """The candidate with its start as large as the first look says, where a single number makes the effect's size.

    Others may say where or how fast: they have no neutral value of zero.
    """
    (name, start), *more = score.candidate.form.items()
    parameters = score.candidate.parameters(score.candidate.joints[0])
    known, sizes = parameters[name], [n for n, _ in more if parameters[n].neutral == 0.0]
    if sizes or known.neutral != 0.0 or not RESIZED[0] < score.factor < RESIZED[1]:
        return score.candidate
    size = min(max(score.factor * start, known.low), known.high)
    return replace(score.candidate, form={**score.candidate.form, name: size})


def of_each(pairs: Sequence[tuple[Candidate, Fit]], count: int) -> list[tuple[Candidate, Fit]]:
    """The best of each of the `count` best effects, and `VARIANTS` more, still in their order.

    Forms and places of one effect that follow the data alike would else leave no room for another that does so too.
    """
    names = list(dict.fromkeys(candidate.effect.name for candidate, _ in pairs))[:count]
    first = [next(k for k, (candidate, _) in enumerate(pairs) if candidate.effect.name == name) for name in names]
    others = [k for k in range(len(pairs)) if k not in first][: VARIANTS + count - len(first)]
    return [pairs[k] for k in sorted([*first, *others])]


USUAL = 3.0  # times the start from which a candidate is looked at: standard deviation of what is expected of its size


@dataclass(frozen=True)
class Columns:
    """What C candidates change, beside the segments' starts and the base constants.

    Attributes:
        scores: of each alone.
        gradient: (C,) of the squared error.
        gram: (C, C) products of the columns, shrinkage included.
    """

    scores: Sequence[Score]
    gradient: Array
    gram: Array


def best_subsets(columns: Columns, size: int) -> list[tuple[float, tuple[Candidate, ...]]]:
    """All sets of `size` candidates that are possible, sized, each with the gain of its first look, the largest first.

    Of effects that help only together none is found alone. Columns are shrunk towards none: of two that do nearly the
    same neither gets a huge share.

    Args:
        columns: of the candidates.
        size: effects in a set.

    Source of best subsets: Hastie, Tibshirani, Friedman, The Elements of Statistical Learning, 3.3.
    """
    found = []
    for chosen in combinations(range(len(columns.scores)), size):
        rows = list(chosen)
        scores = [columns.scores[k] for k in rows]
        if len({(one.candidate.effect, one.candidate.joints) for one in scores}) < size:
            continue
        factors = np.linalg.solve(columns.gram[np.ix_(rows, rows)], columns.gradient[rows])
        if all(possible(one.candidate, float(f)) for one, f in zip(scores, factors, strict=True)):
            sized = tuple(resized(replace(s, factor=float(f))) for s, f in zip(scores, factors, strict=True))
            found.append((float(columns.gradient[rows] @ factors), sized))
    return sorted(found, key=lambda one: -one[0])


def candidate_columns(problem: Problem, base: Fit, wanted: Sequence[Candidate]) -> Columns:
    """Columns of the candidates, of each effect in one form at one place from the start that promises most.

    Args:
        problem: windows to look at.
        base: fit whose residual is to be explained.
        wanted: candidates at their starts.
    """
    view = Screen(problem, base)
    expected = noise_inflation(problem, base.cost) / USUAL**2
    best: dict[tuple[str, tuple[str, ...], tuple[str, ...]], tuple[Score, Array]] = {}
    for candidate, column in view.columns(wanted):
        gradient, size, _ = view.alone(column)
        score = Score(candidate, gradient**2 / (size + expected), gradient / (size + expected))
        key = (candidate.effect.name, candidate.joints, tuple(candidate.form))
        if size > 0.0 and (key not in best or score.gain > best[key][0].gain):
            best[key] = score, column
    if not best:
        return Columns((), np.zeros(0), np.zeros((0, 0)))
    columns = np.stack([column for _, column in best.values()], axis=-1)
    gradients, gram = view.products(columns)
    return Columns([score for score, _ in best.values()], gradients, gram + expected * np.eye(len(gram)))


def possible(candidate: Candidate, factor: float) -> bool:
    """Whether so many times its start is within the bounds of what makes the effect's size."""
    name, start = next(iter(candidate.form.items()))
    known = candidate.parameters(candidate.joints[0])[name]
    value = known.neutral + factor * (start - known.neutral)
    return factor != 0.0 and known.low <= value <= known.high and (factor > 0.0 or known.low < known.neutral)
