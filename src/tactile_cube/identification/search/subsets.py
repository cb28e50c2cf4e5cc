"""Which few effects together could explain a residual: best subsets of all candidates, to first order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.gauss_newton import Fit, noise_inflation
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.screening import Score, Screen
from tactile_cube.identification.search.shortlist import resized

Array = NDArray[np.float64]
USUAL = 3.0  # times the start from which a candidate is looked at: standard deviation of what is expected of its size
BATCH = 24  # candidates simulated at once, which bounds the memory


@dataclass(frozen=True)
class Subset:
    """Effects that are to be fitted together.

    Attributes:
        candidates: started at the sizes that the first look gives them.
        gain: squared error that they would explain together to first order, in units of the sensor's variance.
    """

    candidates: tuple[Candidate, ...]
    gain: float


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


def best_subsets(columns: Columns, size: int) -> list[Subset]:
    """All sets of `size` candidates that are possible, most promising first.

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
            sized = [Score(s.candidate, s.model, s.gain, float(f)) for s, f in zip(scores, factors, strict=True)]
            found.append(Subset(tuple(resized(one) for one in sized), float(columns.gradient[rows] @ factors)))
    return sorted(found, key=lambda one: -one.gain)


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
    for first in range(0, len(wanted), BATCH):
        part = wanted[first : first + BATCH]
        models = [candidate.added_to(base.model)[0] for candidate in part]
        for candidate, model, prediction in zip(part, models, problem.predictions(models), strict=True):
            column = view.column(prediction)
            gradient, size, _ = view.alone(column)
            score = Score(candidate, model, gradient**2 / (size + expected), gradient / (size + expected))
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
