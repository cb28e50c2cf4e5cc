"""A first look at every candidate: how much of the residual could it explain beside the constants of the base model?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.gauss_newton import Fit, precision, temper
from tactile_cube.identification.fitting.model import Model
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.search.candidates import Candidate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Score:
    """How a candidate at finite values looks from the base model.

    Attributes:
        candidate: the effect, form, joint and values.
        model: base model with the effect.
        gain: squared error that it would explain to first order, in units of the sensor's variance.
        factor: best multiple of the effect to first order.
    """

    candidate: Candidate
    model: Model
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
        expected = temper(problem, base.cost) * precision(base.unknowns)
        self.information = base.information + np.diag(expected)
        offset = [(u.of(base.model) - u.centre) / u.scale for u in base.unknowns]
        self.pull = np.einsum("grp,gr->p", base.columns, self.residual, optimize=True) - expected * np.array(offset)

    def column(self, prediction: Array) -> Array:
        """Change of the weighted prediction (G, R) that an effect makes."""
        return np.asarray(self.problem.limited(prediction - self.prediction) * self.problem.weight)

    def terms(self, column: Array) -> tuple[float, float, Array]:
        """Pull on a column, its own size, and its products with the base columns (P,)."""
        freed = self.problem.free(column)
        cross = np.einsum("grp,gr->p", self.free_columns, column, optimize=True)
        return float(np.sum(column * self.residual)), float(np.sum(column * freed)), cross


def screen(problem: Problem, base: Fit, wanted: Sequence[Candidate], batch: int = 24) -> list[Score]:
    """Scores of candidates, best first.

    Args:
        problem: windows to look at.
        base: fit whose residual is to be explained.
        wanted: candidates at their starts.
        batch: candidates simulated at once, which bounds the memory.
    """
    view = Screen(problem, base)
    solved = np.linalg.solve(view.information, view.pull)
    scores = []
    for first in range(0, len(wanted), batch):
        part = list(wanted[first : first + batch])
        models = [candidate.added_to(base.model)[0] for candidate in part]
        for candidate, model, prediction in zip(part, models, problem.predictions(models), strict=True):
            pull, size, cross = view.terms(view.column(prediction))
            left = size - float(cross @ np.linalg.solve(view.information, cross))
            pull -= float(cross @ solved)
            factor = pull / left if left > 1e-6 * size and size > 1e-3 else 0.0
            scores.append(Score(candidate, model, factor * pull, factor))
    return sorted(scores, key=lambda score: -score.gain)
