"""Bounded Levenberg-Marquardt on the marginal likelihood of a multiple-shooting problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.model import Model, Unknown, put_all, read_all
from tactile_cube.identification.problem import Problem

Array = NDArray[np.float64]
CONVERGED = 2e-3  # relative gain below which a fit ends
POSTURE_SPREAD = 0.02  # [rad] joint offsets expected beforehand


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    Attributes:
        model: with the fitted values.
        unknowns: what was fitted.
        cost: marginal squared error, in units of the sensor's variance.
        residual: (G, R) weighted.
        columns: (G, R, P) derivatives per scale at (or near) the fitted values.
        information: (P, P) in units of the scales, prior included.
    """

    model: Model
    unknowns: tuple[Unknown, ...]
    cost: float
    residual: Array = field(repr=False)
    columns: Array = field(repr=False)
    information: Array = field(repr=False)


def fit(
    problem: Problem,
    model: Model,
    unknowns: Sequence[Unknown],
    iterations: int = 4,
    frozen: Fit | None = None,
) -> Fit:
    """Fit the unknowns of a model.

    Args:
        problem: the stretches to fit.
        model: where to start.
        unknowns: what to fit; with `frozen`, beside its unknowns.
        iterations: most accepted or refused steps.
        frozen: a fit whose columns are kept as they are, which spares simulating them; they change little.
    """
    kept = frozen.unknowns if frozen else ()
    everything = (*kept, *unknowns)
    damping, best = 1e-4, None
    for _ in range(iterations):
        prediction, fresh = problem.columns(model, unknowns)
        residual = problem.residual(prediction)
        columns = np.concatenate([frozen.columns, fresh], axis=-1) if frozen else fresh
        cost = float(problem.cost(residual).sum()) + _prior_cost(model, everything)
        if best is not None and cost > best.cost:
            damping *= 10.0
        else:
            gain = np.inf if best is None else (best.cost - cost) / max(best.cost, 1e-9)
            best = Fit(model, everything, cost, residual, columns, _information(problem, columns, everything))
            gradient = _gradient(problem, best)
            damping *= 0.3
            if gain < CONVERGED:
                break
        model = _stepped(best, gradient, damping)
    assert best is not None
    return _finish(problem, best, model)


def renewed(problem: Problem, fitted: Fit, prediction: Array, columns: Array) -> Fit:
    """A fit with residual, columns and information of a problem whose starts were linearised anew."""
    information = _information(problem, columns, fitted.unknowns)
    return Fit(fitted.model, fitted.unknowns, fitted.cost, problem.residual(prediction), columns, information)


def _finish(problem: Problem, best: Fit, last: Model) -> Fit:
    """The last step is taken too if it helps."""
    residual = problem.residual(problem.predictions([last])[0])
    cost = float(problem.cost(residual).sum()) + _prior_cost(last, best.unknowns)
    if cost >= best.cost:
        return best
    return Fit(last, best.unknowns, cost, residual, best.columns, best.information)


def _precision(unknowns: Sequence[Unknown]) -> Array:
    return np.array([(u.scale / POSTURE_SPREAD) ** 2 if u.kind == "posture" else 1e-6 for u in unknowns])


def _prior_cost(model: Model, unknowns: Sequence[Unknown]) -> float:
    postures = [u.of(model) for u in unknowns if u.kind == "posture"]
    return float(np.sum(np.square(postures)) / POSTURE_SPREAD**2)


def _information(problem: Problem, columns: Array, unknowns: Sequence[Unknown]) -> Array:
    gram = np.einsum("grp,grq->pq", columns, problem.free(columns), optimize=True)
    return np.asarray(gram + np.diag(_precision(unknowns)))


def _gradient(problem: Problem, fitted: Fit) -> Array:
    pull = np.einsum("grp,gr->p", fitted.columns, problem.free(fitted.residual), optimize=True)
    values = read_all(fitted.model, fitted.unknowns) / np.array([u.scale for u in fitted.unknowns])
    postures = np.array([u.kind == "posture" for u in fitted.unknowns])
    return np.asarray(pull - np.where(postures, _precision(fitted.unknowns) * values, 0.0))


def _stepped(fitted: Fit, gradient: Array, damping: float) -> Model:
    """Damped Gauss-Newton step; an unknown that would leave its bounds stops there and the others are solved anew."""
    values = read_all(fitted.model, fitted.unknowns)
    scale = np.array([u.scale for u in fitted.unknowns])
    low = np.array([u.low for u in fitted.unknowns])
    high = np.array([u.high for u in fitted.unknowns])
    step = bounded_step(fitted.information, gradient, damping, (low - values) / scale, (high - values) / scale)
    return put_all(fitted.model, fitted.unknowns, values + step * scale)


def bounded_step(information: Array, gradient: Array, damping: float, least: Array, most: Array) -> Array:
    """Step (P,) that minimises the damped quadratic model within the bounds, active bounds found one after another."""
    step = np.zeros(len(gradient))
    held = np.zeros(len(gradient), dtype=bool)
    damped = information + damping * np.diag(np.maximum(np.diag(information), 1e-9))
    for _ in range(len(gradient) + 1):
        loose = ~held
        right = gradient[loose] - damped[np.ix_(loose, held)] @ step[held]
        step[loose] = np.linalg.lstsq(damped[np.ix_(loose, loose)], right, rcond=1e-12)[0]
        outside = loose & ((step < least) | (step > most))
        if not outside.any():
            break
        step = np.where(outside, np.clip(step, least, most), step)
        held |= outside
    return np.clip(step, least, most)
