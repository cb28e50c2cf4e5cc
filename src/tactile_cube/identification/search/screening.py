"""A first look: how much of a residual candidates could explain, to first order."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

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
        self.prediction = problem.windows.by_segment(problem.path(base.model).position)
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
            models = [candidate.added_to(self.base.model)[0] for candidate in part]
            predictions = self.problem.predictions(models, self.base.model)
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


RESIZED = (0.2, 6.0)  # factors of the first look that are believed
AS_GOOD = 0.95  # share of the best first-order gain from which on a start of the same law looks as good


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
