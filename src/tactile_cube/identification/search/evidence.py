"""Comparison of fitted models on held-out trials."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student_t

from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import fit
from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.identification.fitting.resolution import NORMAL_95
from tactile_cube.identification.fitting.unknowns import offset_unknowns
from tactile_cube.measurement.comparing.error import CORRELATED, free_run_error
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model

Array = NDArray[np.float64]
FEWEST_BLOCKS = 5  # for an estimate of their scatter
SLIGHT = 1.0  # [sensor variance] what a number that follows noise alone gains in a segment, in the mean
INFORMATIVE = 0.01  # share of the largest difference; smaller differences are noise
FEWEST_PAIRS = 10  # pairs of segments at a lag that an autocorrelation needs


@dataclass(frozen=True)
class Judgement:
    """Error of a model on held-out segments.

    Attributes:
        model: with the joint offsets of the held-out initialisations.
        costs: (G,) marginal squared error of each segment, in units of the sensor's variance.
        samples: (G,) measured numbers in each.
        residual: (G, R) weighted.
        joint_errors: (n,) RMS error of each joint in units of the sensor noise.
        trial: (G,) to which each belongs; segments of one trial follow each other in time.
    """

    model: Model
    costs: Array
    samples: Array
    residual: Array = field(repr=False)
    joint_errors: Array
    trial: NDArray[np.int64]

    @property
    def error(self) -> float:
        """RMS error in units of the sensor noise; 1 is a perfect model."""
        return float(np.sqrt(self.costs.sum() / self.samples.sum()))


def judge(problem: Problem, held_out: Recording, model: Model) -> Judgement:
    """Return the error of a model on held-out segments; only joint offsets of unseen initialisations are fitted."""
    fitted = fit(problem, model, offset_unknowns(held_out, problem.shooting.sizes), iterations=3)
    samples = np.count_nonzero(problem.weight, axis=1)
    costs = charged(problem.cost(fitted.residual), samples, problem.chosen_numbers(fitted.model))
    joints = joint_errors(problem, fitted.residual)
    return Judgement(fitted.model, costs, samples, fitted.residual, joints, problem.segment_trial)


def charged(costs: Array, samples: NDArray[np.int64], numbers: NDArray[np.int64]) -> Array:
    """Return squared errors (G,) corrected for initial-state parameters (G,) that were fitted to the segment itself.

    Generalised cross-validation: with k of n independent numbers fitted, the excess over the noise counts
    (n / (n - k))^2 times. It is autocorrelated, so few of its samples are independent.
    Source: Golub, Heath, Wahba, Technometrics 21, 1979.
    """
    independent = np.maximum(samples / CORRELATED, numbers + 1.0)
    excess = np.maximum(costs - samples, 0.0)
    return np.asarray(costs + excess * ((independent / (independent - numbers)) ** 2 - 1.0))


def joint_errors(problem: Problem, residual: Array) -> Array:
    """Return RMS residuals (n,) of each joint in units of the noise, initial states projected out."""
    squares, present = joint_squares(problem, residual)
    return np.asarray(np.sqrt(np.maximum(squares.sum(axis=0), 0.0) / np.maximum(present.sum(axis=0), 1)))


def segment_errors(problem: Problem, residual: Array) -> Array:
    """Return the same for each segment (G, n); nan where nothing was measured."""
    squares, present = joint_squares(problem, residual)
    return np.asarray(np.sqrt(np.maximum(squares, 0.0) / np.where(present > 0, present, np.nan)))


def joint_squares(problem: Problem, residual: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return squared residuals (G, n) in units of the noise, initial states projected out, and the samples in each."""
    joint_of = problem.windows.joint_of
    shape = (len(residual), -1, len(joint_of))
    present = np.count_nonzero(problem.weight.reshape(shape), axis=1)
    squares = (residual * problem.free(residual)).reshape(shape).sum(axis=1)
    joints = len(problem.shooting.recording.joints)
    for sensor in range(joints, len(joint_of)):
        squares[:, joint_of[sensor]] += squares[:, sensor]
        present[:, joint_of[sensor]] += present[:, sensor]
    return squares[:, :joints], present[:, :joints]


def gain(before: Judgement, after: Judgement) -> float:
    """Return the share of the squared error that the second model removes."""
    return float(1.0 - after.costs.sum() / before.costs.sum())


def worse(other: Judgement, best: Judgement, criteria: Criteria = STANDARD) -> bool:
    """Return whether the held-out trials reject `other` in favour of the best model.

    The difference has to exceed `band` standard deviations from block to block, and what `as_good` allows.
    """
    return not as_good(other, best, criteria) and standing_out(likelihood(other, best), best) > criteria.band


def as_good(other: Judgement, best: Judgement, criteria: Criteria = STANDARD) -> bool:
    """Return whether `other` errs by little more than the best model: what can be removed must not be missed.

    The difference may be the gain of a law by chance beside slightly wrong constants, and a part (`detail`) of what
    the better model leaves unexplained itself.
    """
    unexplained = max(float(best.costs.sum() - best.samples.sum()), 0.0)
    allowed = criteria.least_gain * float(best.samples.sum()) + criteria.detail * unexplained
    return bool((other.costs - best.costs).sum() <= allowed)


def lacking(less: Judgement, more: Judgement, criteria: Criteria = STANDARD, looked_at: int = 1) -> bool:
    """Return whether a set is significantly better than a subset, corrected for the number of laws screened."""
    return gain(less, more) > criteria.least_gain and p_value(less, more) * looked_at <= criteria.significant


def likelihood(before: Judgement, after: Judgement) -> Array:
    """Return twice the log-likelihood ratio (G,) of two models by segment, the variance of the errors unknown.

    Near the noise floor this is the difference of squared errors; far from it, their ratio, so that no single segment
    decides. The sensor variance counts as one more sample, which keeps a joint at rest finite.
    """
    return np.asarray((before.samples + 1.0) * np.log((1.0 + before.costs) / (1.0 + after.costs)))


def standing_out(difference: Array, judged: Judgement) -> float:
    """Return the sum of differences (G,) over its standard error, estimated from block to block."""
    blocks = in_blocks(difference, judged)
    if len(blocks) < FEWEST_BLOCKS:
        return 0.0
    scatter = float(blocks.std(ddof=1)) * np.sqrt(len(blocks))
    return float(blocks.sum()) / scatter if scatter > 0.0 else 0.0


def p_value(before: Judgement, after: Judgement) -> float:
    """Return the one-sided p-value of a paired t-test over blocks of segments; low if the second model is better.

    Blocks are as long as the autocorrelation of the differences.
    """
    difference = likelihood(before, after)
    count = len(in_blocks(difference, after))
    return float(student_t.sf(standing_out(difference, after), max(count - 1, 1)))


def in_blocks(difference: Array, judged: Judgement) -> Array:
    """Return sums (B,) of differences (G,) over blocks of neighbouring segments, as long as their autocorrelation.

    Ties are left out if enough segments differ: segments at rest would look like a correlation as long as a trial.
    """
    counted = judged.samples > 0
    least = max(SLIGHT, INFORMATIVE * float(np.abs(difference).max(initial=0.0)))
    informative = counted & (np.abs(difference) >= least)
    if np.count_nonzero(informative) >= FEWEST_PAIRS:
        counted = informative
    difference, trial = difference[counted], judged.trial[counted]
    length = correlation_length(difference, trial)
    if length == 1:
        return difference
    by_trial = np.split(difference, np.flatnonzero(np.diff(trial)) + 1)
    sums = [np.add.reduceat(part, np.arange(0, len(part), length)) for part in by_trial]
    return np.concatenate(sums)


def correlation_length(difference: Array, trial: NDArray[np.int64]) -> int:
    """Return the integrated autocorrelation time of differences (G,) in segments: 1 + 2 x the sum of autocorrelations.

    Signs are used, since sizes follow the motion, up to the first lag that is not significant.
    Source: Geyer, Practical Markov chain Monte Carlo, Statistical Science 7, 1992.
    """
    signs = np.sign(difference) - np.mean(np.sign(difference)) if len(difference) else difference
    variance = float(np.mean(signs**2)) if len(signs) else 0.0
    length = 1.0
    for lag in range(1, len(signs) // FEWEST_BLOCKS):
        same = trial[lag:] == trial[:-lag]
        if variance == 0.0 or np.count_nonzero(same) < FEWEST_PAIRS:
            break
        correlation = float(np.mean((signs[lag:] * signs[:-lag])[same])) / variance
        if correlation < NORMAL_95 / np.sqrt(np.count_nonzero(same)):
            break
        length += 2.0 * correlation
    return int(np.ceil(length))


ITERATIONS = 3  # that the joint offsets of unseen initialisations take


class HeldOut:
    """Validation trials, simulated freely from their measured starts."""

    def __init__(self, shooting: Shooting, trials: Recording, noise: Array, offsets: Mapping[int, Array]) -> None:
        """Take the validation trials.

        Args:
            shooting: simulates.
            trials: the held-out ones.
            noise: (n,) or (2 n,) of the position sensors [rad].
            offsets: initialisation -> (n,) where those begin that a model does not know [rad].
        """
        self.shooting, self.trials, self.offsets = shooting, trials, offsets
        self.noise = noise

    @cached_property
    def problem(self) -> Problem:
        """The problem in which joint offsets are fitted."""
        return Problem(self.shooting, self.shooting.cut(self.trials, self.noise))

    def error(self, model: Model) -> float:
        """Return RMS error of free runs [rad], infinite where one ran away; only unseen joint offsets are fitted."""
        unseen = set(self.offsets) - set(model.offsets)
        found = model.with_offsets(self.offsets)
        if unseen:
            free = [u for u in offset_unknowns(self.trials, self.shooting.sizes) if u.initialisation in unseen]
            self.problem.linearise_starts(found)
            found = fit(self.problem, found, free, ITERATIONS).model
        runs = self.shooting.free_runs([found], self.trials.trials)[0]
        if not all(np.isfinite(run.position).all() for run in runs):
            return float("inf")
        return free_run_error(self.trials, runs).overall

    def worse(self, tried: Model, before: Model, alike: float = STANDARD.least_gain) -> bool:
        """Return whether a model is worse than the one before, by more than the share `alike` of the squared error."""
        return self.error(tried) ** 2 > (1.0 + alike) * self.error(before) ** 2
