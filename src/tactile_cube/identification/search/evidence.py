"""Judging fitted models on trials that the fit never saw."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.stats import wilcoxon

from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.base import offset_unknowns
from tactile_cube.identification.fitting.gauss_newton import fit
from tactile_cube.identification.fitting.model import Model
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.measurement.recordings.recording import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Judgement:
    """How a model does on held-out segments.

    Attributes:
        model: with the joint offsets of the held-out initialisations.
        costs: (G,) marginal squared error of each segment, in units of the sensor's variance.
        samples: (G,) measured numbers in each.
        residual: (G, R) weighted.
        joint_errors: (n,) RMS error of each joint in units of the sensor noise.
    """

    model: Model
    costs: Array
    samples: Array
    residual: Array = field(repr=False)
    joint_errors: Array

    @property
    def error(self) -> float:
        """RMS error in units of the sensor noise; 1 is a perfect model."""
        return float(np.sqrt(self.costs.sum() / self.samples.sum()))


def judge(problem: Problem, held_out: Recording, model: Model) -> Judgement:
    """Error of a model on held-out segments; only the joint offsets of unseen initialisations are fitted there."""
    fitted = fit(problem, model, offset_unknowns(held_out, problem.shooting.sizes), iterations=3)
    samples = np.count_nonzero(problem.weight, axis=1)
    costs = problem.cost(fitted.residual)
    return Judgement(fitted.model, costs, samples, fitted.residual, _joint_errors(problem, fitted.residual))


def _joint_errors(problem: Problem, residual: Array) -> Array:
    """RMS (n,) of each joint's residual with the starts of segments taken out."""
    joints = problem.windows.measured.shape[2]
    products = (residual * problem.free(residual)).reshape(-1, joints)
    present = np.count_nonzero(problem.weight.reshape(-1, joints), axis=0)
    return np.asarray(np.sqrt(np.maximum(products.sum(axis=0), 0.0) / np.maximum(present, 1)))


def gain(before: Judgement, after: Judgement) -> float:
    """Share of the squared error that the second model takes away."""
    return float(1.0 - after.costs.sum() / before.costs.sum())


def worse(other: Judgement, best: Judgement, criteria: Criteria = STANDARD) -> bool:
    """Whether the held-out trials speak against `other`.

    The difference has to stand out of its scatter from segment to segment, and to be more than a part of what the
    better model leaves unexplained itself: that much a law may differ in detail from the real thing.
    """
    difference = (other.costs - best.costs)[best.samples > 0]
    unexplained = max(float(best.costs.sum() - best.samples.sum()), 0.0)
    if difference.sum() <= criteria.clear + criteria.large_gain * unexplained:
        return False
    scatter = float(difference.std(ddof=1)) * np.sqrt(len(difference)) if len(difference) > 1 else np.inf
    return bool(difference.sum() > criteria.stands_out * scatter or p_value(other, best) < criteria.significant_if_most)


def p_value(before: Judgement, after: Judgement) -> float:
    """Probability of such paired differences if the second model were no better (Wilcoxon, one-sided)."""
    difference = (before.costs - after.costs)[before.samples > 0]
    if len(difference) < 5 or not np.any(difference):
        return 1.0
    return float(wilcoxon(difference, alternative="greater").pvalue)
