"""Bounded Levenberg-Marquardt on the marginal likelihood of a multiple-shooting problem."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array
from tactile_cube.identification.fitting.problem import STEP, Problem
from tactile_cube.identification.fitting.unknowns import Unknown, put_all, read_all
from tactile_cube.measurement.comparing.error import CORRELATED
from tactile_cube.measurement.replay.model import Model

DAMPING = 1e-4  # of a first step, in units of the information
POOR = 1.0  # damping, in units of the information, from which on a fit that stops takes finer derivatives
KEPT = 0.8  # part of what a step promised; if it gained that, the derivatives hold where it led
CONVERGED = 2e-3  # relative gain below which a fit ends that only has to be compared with others
SHORTER = (
    6  # shorter and shorter steps that are tried before a fit ends; each costs one simulation, derivatives cost many
)


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    Attributes:
        model: with the fitted values.
        unknowns: what was fitted.
        cost: marginal squared error, in units of the sensor's variance.
        prior_penalty: squared distance of the unknowns from what was expected, in standard deviations.
        residual: (G, R) weighted.
        columns: (G, R, P) derivatives per scale at (or near) the fitted values.
        information: (P, P) of the data, in units of the scales.
        settled: whether no step promises a gain any more, by derivatives that hold where it is.
    """

    model: Model
    unknowns: tuple[Unknown, ...]
    cost: float
    prior_penalty: float
    residual: Array = field(repr=False)
    columns: Array = field(repr=False)
    information: Array = field(repr=False)
    settled: bool = False


def fit(
    problem: Problem,
    model: Model,
    unknowns: Sequence[Unknown],
    iterations: int = 4,
    frozen: Fit | None = None,
    converged: float = CONVERGED,
) -> Fit:
    """Fit the unknowns of a model.

    Args:
        problem: the windows to fit.
        model: where to start.
        unknowns: what to fit; with `frozen`, beside its unknowns; none beside them is the chord method.
        iterations: most steps that are taken; 0 linearises the problem at the model.
        frozen: a fit whose columns are kept as they are, which spares simulating them; they change little.
        converged: relative gain of a step, made or promised, below which the fit ends.
    """
    everything = (*(frozen.unknowns if frozen else ()), *unknowns)
    step = STEP
    best = _linearised(problem, model, unknowns, everything, frozen, step)
    damping = DAMPING
    for iteration in range(iterations):
        weight = noise_inflation(problem, best.cost)
        reached, gain, trusted = best.cost + weight * best.prior_penalty, 0.0, True
        for _ in range(SHORTER):
            stepped, promised = _stepped(problem, best, weight, damping)
            if promised < converged * reached:
                break
            tried = _evaluated(problem, best, stepped)
            left = tried.cost + weight * tried.prior_penalty
            trusted = trusted and reached - left > KEPT * promised
            if left < reached:
                best, gain = tried, (reached - left) / max(reached, 1e-9)
                break
            damping *= 10.0
        if trusted and _promises_little(problem, best, converged):
            return replace(best, settled=True)
        shortened, damping = damping >= POOR, 0.3 * damping
        if gain < converged:
            if not shortened or step == problem.finest or not unknowns:
                break
            step, damping = problem.finest, DAMPING
        if unknowns and iteration < iterations - 1:
            best = _linearised(problem, best.model, unknowns, everything, frozen, step)
    return best


def _promises_little(problem: Problem, fitted: Fit, converged: float) -> bool:
    """Return whether the undamped step from a fit promises a smaller part of its cost than `converged`."""
    weight = noise_inflation(problem, fitted.cost)
    promised = _stepped(problem, fitted, weight, DAMPING)[1]
    return promised < converged * (fitted.cost + weight * fitted.prior_penalty)


def _linearised(
    problem: Problem,
    model: Model,
    unknowns: Sequence[Unknown],
    everything: tuple[Unknown, ...],
    frozen: Fit | None,
    step: float,
) -> Fit:
    """Linearise the problem at a model; the derivatives are simulated as neighbours along its path."""
    prediction, fresh = problem.columns(model, unknowns, step)
    residual = problem.residual(prediction)
    columns = np.concatenate([frozen.columns, fresh], axis=-1) if frozen else fresh
    cost = float(problem.cost(residual).sum())
    return Fit(
        model, everything, cost, prior_penalty(model, everything), residual, columns, _information(problem, columns)
    )


def _evaluated(problem: Problem, near: Fit, model: Model) -> Fit:
    """Evaluate a model by one exact simulation; keep the derivatives of a fit close to it."""
    residual = problem.residual(problem.prediction(model))
    cost, penalty = float(problem.cost(residual).sum()), prior_penalty(model, near.unknowns)
    return replace(near, model=model, cost=cost, prior_penalty=penalty, residual=residual)


def noise_inflation(problem: Problem, cost: float) -> float:
    """Return the weight of the prior.

    While the model is wrong its error is far above the noise and autocorrelated; treated as white noise it would bias
    the constants. So the prior counts as many times more as the error is larger and longer than noise.
    """
    excess = cost / max(float(np.count_nonzero(problem.weight)), 1.0) - 1.0
    return 1.0 + CORRELATED * max(excess, 0.0)


def prior_penalty(model: Model, unknowns: Sequence[Unknown]) -> float:
    """Return the squared distance from what is expected beforehand, in standard deviations."""
    return float(sum(((u.of(model) - u.centre) / u.spread) ** 2 for u in unknowns))


def precision(unknowns: Sequence[Unknown]) -> Array:
    """Return weights (P,) of the expectations, per squared scale; a trace for those without, so that none is flat."""
    return np.array([(u.scale / u.spread) ** 2 + 1e-9 for u in unknowns])


def _information(problem: Problem, columns: Array) -> Array:
    return np.asarray(np.einsum("grp,grq->pq", columns, problem.free(columns), optimize=True))


def _stepped(problem: Problem, fitted: Fit, trust: float, damping: float) -> tuple[Model, float]:
    """Return the damped Gauss-Newton step, and by how much it promises to lower the cost with its weighted penalty.

    An unknown that would leave its bounds stops there and the others are solved anew.
    """
    values = read_all(fitted.model, fitted.unknowns)
    scale, centre, low, high = (
        np.array([getattr(u, key) for u in fitted.unknowns]) for key in ("scale", "centre", "low", "high")
    )
    weight = trust * precision(fitted.unknowns)
    pull = np.einsum("grp,gr->p", fitted.columns, problem.free(fitted.residual), optimize=True)
    gradient = pull - weight * (values - centre) / scale
    information = fitted.information + np.diag(weight)
    step = bounded_step(information, gradient, damping, (low - values) / scale, (high - values) / scale)
    promised = float(2.0 * gradient @ step - step @ information @ step)
    return put_all(fitted.model, fitted.unknowns, values + step * scale), promised


def bounded_step(information: Array, gradient: Array, damping: float, least: Array, most: Array) -> Array:
    """Step (P,) that minimises the damped quadratic model within the bounds, active bounds found one after another."""
    step: Array = np.zeros(len(gradient))
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
