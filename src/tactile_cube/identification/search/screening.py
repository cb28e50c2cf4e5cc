"""A first look at every candidate: how much of the residual could it explain beside the constants of the base model?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.gauss_newton import Fit, noise_inflation, precision
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.measurement.replay.model import Model

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
        expected = noise_inflation(problem, base.cost) * precision(base.unknowns)
        self.information = base.information + np.diag(expected)
        offset = [(u.of(base.model) - u.centre) / u.scale for u in base.unknowns]
        self.gradient = np.einsum("grp,gr->p", base.columns, self.residual, optimize=True) - expected * np.array(offset)

    def column(self, prediction: Array) -> Array:
        """Change of the weighted prediction (G, R) that an effect makes."""
        return np.asarray(self.problem.limited(prediction - self.prediction) * self.problem.weight)

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


def screen(problem: Problem, base: Fit, wanted: Sequence[Candidate], batch: int = 24) -> list[Score]:
    """Scores of candidates, best first.

    Args:
        problem: windows to look at.
        base: fit whose residual is to be explained.
        wanted: candidates at their starts.
        batch: candidates simulated at once, which bounds the memory.
    """
    view = Screen(problem, base)
    scores = []
    for first in range(0, len(wanted), batch):
        part = list(wanted[first : first + batch])
        models = [candidate.added_to(base.model)[0] for candidate in part]
        for candidate, model, prediction in zip(part, models, problem.predictions(models), strict=True):
            gradient, left, size = view.alone(view.column(prediction))
            factor = gradient / left if left > 1e-6 * size and size > 1e-3 else 0.0
            scores.append(Score(candidate, model, factor * gradient, factor))
    return sorted(scores, key=lambda score: -score.gain)
