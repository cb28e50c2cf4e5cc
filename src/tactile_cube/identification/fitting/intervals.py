"""Values with 95 % intervals: the final fit on all fitted trials, and what its residual says about its certainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.gauss_newton import Fit, fit, precision
from tactile_cube.identification.fitting.model import Model, Unknown, read_all
from tactile_cube.identification.fitting.problem import Problem

Array = NDArray[np.float64]
NORMAL_95 = 1.96


@dataclass(frozen=True)
class Fitted:
    """The final fit: the model and, for each unknown, the half width (P,) of its 95 % interval."""

    model: Model
    fit: Fit
    half_width: Array


def final_fit(problem: Problem, model: Model, unknowns: Sequence[Unknown], iterations: int = 3) -> Fitted:
    """Refit constants and effects of a model on all stretches, with intervals."""
    problem.linearise_starts(model)
    fitted = fit(problem, model, unknowns, iterations)
    return Fitted(fitted.model, fitted, NORMAL_95 * standard_errors(problem, fitted))


def standard_errors(problem: Problem, fitted: Fit) -> Array:
    """Standard errors (P,) of the unknowns.

    The residual of a model that is not perfect remembers itself; so the scatter of the score is taken segment by
    segment (cluster-robust), and never less than the sensor's noise alone would give.
    """
    freed = problem.free(fitted.residual)
    scores = np.einsum("grp,gr->gp", fitted.columns, freed, optimize=True)
    inverse = np.linalg.pinv(fitted.information + np.diag(precision(fitted.unknowns)))
    segments, unknowns = scores.shape
    correction = segments / max(segments - unknowns, 1)
    robust = inverse @ (scores.T @ scores * correction) @ inverse
    variance = np.maximum(np.diag(robust), np.diag(inverse))
    return np.asarray(np.sqrt(variance) * np.array([u.scale for u in fitted.unknowns]))


def bounds(fitted: Fitted) -> dict[tuple[str, str, int, int], tuple[float, float, float]]:
    """(kind, key, place, initialisation) -> value and interval, cut at the unknown's own bounds."""
    values = read_all(fitted.model, fitted.fit.unknowns)
    return {
        (u.kind, u.key, u.place, u.initialisation): (
            float(value),
            float(min(max(value - half, u.low), value)),
            float(max(min(value + half, u.high), value)),
        )
        for u, value, half in zip(fitted.fit.unknowns, values, fitted.half_width, strict=True)
    }
