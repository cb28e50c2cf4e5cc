"""Values with 95 % intervals: the final fit on all fitted trials, what its residual and its time step leave unsure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.gauss_newton import Fit, fit, precision
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.resolution import step_shift
from tactile_cube.identification.fitting.unknowns import Unknown, read_all
from tactile_cube.measurement.replay.model import Model

Array = NDArray[np.float64]
NORMAL_95 = 1.96
UNDECIDED = 0.1  # squared error, in units of the residual's variance; 1 is a standard error of one unknown


@dataclass(frozen=True)
class Fitted:
    """The final fit.

    Attributes:
        model: with the fitted values.
        fit: where they come from.
        half_width: (P,) of the 95 % interval that noise and misfit leave each unknown.
        step_shift: (P,) by which each unknown would move in much shorter simulation steps.
    """

    model: Model
    fit: Fit
    half_width: Array
    step_shift: Array


def final_fit(problem: Problem, model: Model, unknowns: Sequence[Unknown], iterations: int = 12) -> Fitted:
    """Refit constants and effects of a model on all windows, with intervals.

    Where two numbers do nearly the same, the error is nearly flat along their valley: the fit goes on until a step
    gains less than the noise decides.
    """
    problem.linearise_starts(model)
    fitted = fit(problem, model, unknowns, iterations, converged=UNDECIDED / np.count_nonzero(problem.weight))
    scales = np.array([u.scale for u in fitted.unknowns])
    half_width = NORMAL_95 * standard_errors(problem, fitted) * scales
    return Fitted(fitted.model, fitted, half_width, step_shift(problem, fitted))


def standard_errors(problem: Problem, fitted: Fit, groups: Sequence[int] | None = None) -> Array:
    """Standard errors (P,) of the unknowns, in units of their scales; `groups` of segments that err alike, if any do.

    The residual of a model that is not perfect remembers itself; so the scatter of the score is taken segment by
    segment (cluster-robust), and never less than white noise as large as the residual would give: of few long segments
    the scatter says little.
    """
    freed = problem.free(fitted.residual)
    scores = np.einsum("grp,gr->gp", fitted.columns, freed, optimize=True)
    if groups is not None:
        scores = np.stack([scores[np.equal(groups, one)].sum(axis=0) for one in sorted(set(groups))])
    sizes, directions = np.linalg.eigh(fitted.information + np.diag(precision(fitted.unknowns)))
    sure = np.maximum(sizes, np.finfo(float).eps * sizes.max())  # what the data say nothing of may round to below zero
    inverse = (directions / sure) @ directions.T
    segments, unknowns = scores.shape
    correction = segments / max(segments - unknowns, 1)
    robust = inverse @ (scores.T @ scores * correction) @ inverse
    variance = max(fitted.cost / max(float(np.count_nonzero(problem.weight)), 1.0), 1.0)
    return np.asarray(np.sqrt(np.maximum(np.diag(robust), variance * np.diag(inverse))))


def bounds(fitted: Fitted) -> dict[tuple[str, str, int, int], tuple[float, float, float]]:
    """(kind, key, place, initialisation) -> value and interval, cut at the unknown's own bounds.

    The value is the best one in the model's own steps. The interval reaches from there to the best one in much shorter
    steps, and beyond both by the half width.
    """
    values = read_all(fitted.model, fitted.fit.unknowns)
    below = fitted.half_width - np.minimum(fitted.step_shift, 0.0)
    above = fitted.half_width + np.maximum(fitted.step_shift, 0.0)
    return {
        (u.kind, u.key, u.place, u.initialisation): (
            float(value),
            float(min(max(value - less, u.low), value)),
            float(max(min(value + more, u.high), value)),
        )
        for u, value, less, more in zip(fitted.fit.unknowns, values, below, above, strict=True)
    }
