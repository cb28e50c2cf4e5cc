"""Judging fitted models on trials that the fit never saw."""

from __future__ import annotations

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
FEWEST_BLOCKS = 5  # that a scatter is told from
SLIGHT = 1.0  # [sensor variance] what a number that follows noise alone gains in a segment, in the mean
FEWEST_PAIRS = 10  # of segments so far apart, that an autocorrelation needs


@dataclass(frozen=True)
class Judgement:
    """How a model does on held-out segments.

    Attributes:
        model: with the joint offsets of the held-out initialisations.
        costs: (G,) marginal squared error of each segment, in units of the sensor's variance.
        samples: (G,) measured numbers in each.
        residual: (G, R) weighted.
        joint_errors: (n,) RMS error of each joint in units of the sensor noise.
        trial: (G,) to which each belongs; segments of one trial follow each other in time.
        joint_costs: (G, n) part of the squared error that is each joint's; empty where it is not known.
    """

    model: Model
    costs: Array
    samples: Array
    residual: Array = field(repr=False)
    joint_errors: Array
    trial: NDArray[np.int64]
    joint_costs: Array = field(default_factory=lambda: np.zeros((0, 0)), repr=False)

    @property
    def error(self) -> float:
        """RMS error in units of the sensor noise; 1 is a perfect model."""
        return float(np.sqrt(self.costs.sum() / self.samples.sum()))


def judge(problem: Problem, held_out: Recording, model: Model) -> Judgement:
    """Error of a model on held-out segments; only the joint offsets of unseen initialisations are fitted there."""
    fitted = fit(problem, model, offset_unknowns(held_out, problem.shooting.sizes), iterations=3)
    samples = np.count_nonzero(problem.weight, axis=1)
    costs = charged(problem.cost(fitted.residual), samples, problem.chosen_numbers(fitted.model))
    joints = joint_errors(problem, fitted.residual)
    squares = np.maximum(_joint_squares(problem, fitted.residual)[0], 0.0)
    shares = squares / np.maximum(squares.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    trial = problem.segment_trial
    return Judgement(fitted.model, costs, samples, fitted.residual, joints, trial, costs[:, None] * shares)


def charged(costs: Array, samples: NDArray[np.int64], numbers: NDArray[np.int64]) -> Array:
    """Squared errors (G,) with a charge for numbers (G,) of a segment's start that were chosen by the segment itself.

    Generalised cross-validation: of n independent numbers k choose, so what is left counts (n / (n - k))^2 times. What
    is above the noise remembers itself, so that few of its samples are independent; what is noise is charged nothing.
    Source: Golub, Heath, Wahba, Technometrics 21, 1979.
    """
    independent = np.maximum(samples / CORRELATED, numbers + 1.0)
    excess = np.maximum(costs - samples, 0.0)
    return np.asarray(costs + excess * ((independent / (independent - numbers)) ** 2 - 1.0))


def joint_squares(problem: Problem, residual: Array) -> Array:
    """Squared residuals (n,) of each joint's sensors, in units of the noise, with the starts of segments taken out."""
    return np.asarray(np.maximum(_joint_squares(problem, residual)[0].sum(axis=0), 0.0))


def joint_errors(problem: Problem, residual: Array) -> Array:
    """RMS (n,) of the residual of each joint's sensors with the starts of segments taken out."""
    squares, present = _joint_squares(problem, residual)
    return np.asarray(np.sqrt(np.maximum(squares.sum(axis=0), 0.0) / np.maximum(present.sum(axis=0), 1)))


def segment_errors(problem: Problem, residual: Array) -> Array:
    """The same of each segment, (G, n); nan where nothing was measured."""
    squares, present = _joint_squares(problem, residual)
    return np.asarray(np.sqrt(np.maximum(squares, 0.0) / np.where(present > 0, present, np.nan)))


def _joint_squares(problem: Problem, residual: Array) -> tuple[Array, NDArray[np.int64]]:
    """Squared residuals (G, n) with the starts taken out, and how many numbers were measured."""
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
    """Share of the squared error that the second model takes away."""
    return float(1.0 - after.costs.sum() / before.costs.sum())


def worse(other: Judgement, best: Judgement, criteria: Criteria = STANDARD) -> bool:
    """Whether the held-out trials speak against `other`.

    The difference has to stand out of its scatter from block to block, and to be more than a law gains by chance beside
    slightly wrong constants, and more than a part of what the better model leaves unexplained itself: that much a law
    may differ in detail from the real thing.
    """
    difference = other.costs - best.costs
    unexplained = max(float(best.costs.sum() - best.samples.sum()), 0.0)
    allowed = criteria.least_gain * float(best.samples.sum()) + criteria.detail * unexplained
    return bool(difference.sum() > allowed and standing_out(likelihood(other, best), best) > criteria.band)


def lacking(less: Judgement, more: Judgement, criteria: Criteria = STANDARD, looked_at: int = 1) -> bool:
    """Whether held-out trials prove what one set has beyond another, one of so many effects that it might have.

    It has to earn its price, and to be no chance. Where the smaller set leaves no more than is tolerated it has to take
    more than a law may differ in detail from the real thing.
    """
    earned = gain(less, more) > criteria.least_gain and p_value(less, more) * looked_at <= criteria.significant
    return earned and (less.joint_errors.max() > criteria.tolerated or worse(less, more, criteria))


def likelihood(before: Judgement, after: Judgement) -> Array:
    """Twice the log likelihood (G,) that each segment gains by the second model, the size of its errors unknown.

    At the noise that is the difference of squared errors; far from it, ratios count, so that no single segment decides.
    The sensor's variance counts as one sample more: else a joint that rests as its model does were infinitely likely.
    """
    return np.asarray((before.samples + 1.0) * np.log((1.0 + before.costs) / (1.0 + after.costs)))


def standing_out(difference: Array, judged: Judgement) -> float:
    """Sum of differences (G,) in units of its own scatter, from block to block."""
    blocks = in_blocks(difference, judged)
    if len(blocks) < FEWEST_BLOCKS:
        return 0.0
    scatter = float(blocks.std(ddof=1)) * np.sqrt(len(blocks))
    return float(blocks.sum()) / scatter if scatter > 0.0 else 0.0


def p_value(before: Judgement, after: Judgement) -> float:
    """Probability of such paired differences if the second model were no better (Student's t over blocks, one-sided).

    What is paired are blocks of segments as long as the differences remember themselves.
    """
    difference = likelihood(before, after)
    count = len(in_blocks(difference, after))
    return float(student_t.sf(standing_out(difference, after), max(count - 1, 1)))


def in_blocks(difference: Array, judged: Judgement) -> Array:
    """Sums (B,) of differences (G,) over neighbouring segments of a trial, as many as their correlation is long.

    Where enough segments tell the two models apart the others are left out, as ties are: where nothing moves neither
    is better, and next to trials in which one always is that would pass for a correlation as long as a trial.
    """
    counted = judged.samples > 0
    telling = counted & (np.abs(difference) >= SLIGHT)
    if np.count_nonzero(telling) >= FEWEST_PAIRS:
        counted = telling
    difference, trial = difference[counted], judged.trial[counted]
    length = correlation_length(difference, trial)
    if length == 1:
        return difference
    sums = [np.add.reduceat(part, np.arange(0, len(part), length)) for part in _by_trial(difference, trial)]
    return np.concatenate(sums)


def correlation_length(difference: Array, trial: NDArray[np.int64]) -> int:
    """How many neighbouring differences (G,) say as much as one: 1 + 2 x the sum of their autocorrelation.

    Of signs, for these are what a signed-rank test takes as independent; sizes follow the motion. Up to the first lag
    at which they cannot be told from independent ones. Source: Geyer, Practical Markov chain Monte Carlo, Statistical
    Science 7, 1992.
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


def _by_trial(values: Array, trial: NDArray[np.int64]) -> list[Array]:
    return np.split(values, np.flatnonzero(np.diff(trial)) + 1)


ITERATIONS = 3  # that the joint offsets of unseen initialisations take


class HeldOut:
    """Trials to judge by, simulated freely from their measured starts."""

    def __init__(self, shooting: Shooting, trials: Recording, noise: Array, offsets: Mapping[int, Array]) -> None:
        """Take what judges.

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
        """By which joint offsets are found."""
        return Problem(self.shooting, self.shooting.cut(self.trials, self.noise))

    def error(self, model: Model) -> float:
        """RMS error of free runs [rad], infinite where one ran away; only unseen joint offsets are fitted."""
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
        """Whether a model does worse than what went before, by more than a part of the squared error."""
        return self.error(tried) ** 2 > (1.0 + alike) * self.error(before) ** 2
