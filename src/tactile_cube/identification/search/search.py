"""A recording divided in trials to fit and to judge by, and the laws that may be missing there."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit, fit, renewed
from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.identification.fitting.unknowns import Unknown, base_unknowns, every_effect
from tactile_cube.identification.search.candidates import Candidate, candidates, model_unknowns
from tactile_cube.identification.search.evidence import HeldOut, Judgement, gain, judge, p_value
from tactile_cube.identification.search.explanation import Explanation, Proposal
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, nominal_model
from tactile_cube.measurement.replay.windows import Windows

Array = NDArray[np.float64]
LONG = 8  # most iterations of a refit; one that converges ends before
SEGMENTS = 132  # enough data to judge by, 52.8 s of a finger; the final fit takes all
RENEWED, HELPS = 3, 0.98  # times that starts are taken anew, and part of the squared error that has to be left for that
FITTED = 2  # part of as many that a refit of a search takes: no answer was lost by it, and half the time saved
ENOUGH = 24  # held-out segments at least
FEWEST_ROWS = 8  # of a segment, for its start is unknown too
GROWN = 3.0  # squared, an order of magnitude: from there on few unstable segments outweigh all stable ones
MOSTLY = 0.9  # quantile over the segments: one that tips over is no reason to cut all of them
FIRST_ANSWER = 10.0  # [s] after which the best answer so far is said, then after twice as long each time


class BestSoFar:
    """Passes lines of progress on, and from time to time the best answer so far and what is tried next."""

    def __init__(self, say: Callable[[str], None]) -> None:
        """Begin to count time; `say` takes the lines."""
        self.pass_on, self.answer, self.following = say, "", ""
        self.began, self.due = time.monotonic(), FIRST_ANSWER

    def __call__(self, line: str) -> None:
        """Pass a line on, and the best answer where it is time."""
        self.pass_on(line)
        if self.answer and time.monotonic() - self.began > self.due:
            self.pass_on(f"best answer so far: {self.answer}; next: {self.following}")
            self.due *= 2.0


class Search:
    """A recording with its trials divided in two, and the effects that may be missing.

    Attributes:
        shooting: simulates both parts.
        fitted: the trials to fit.
        held_out: the trials to judge by.
        start: the model to begin with, of the trials to fit; `start_held_out` of the others.
        all_windows: of the trials to fit; `problem` takes as many of them as a search needs.
        validation: the problem of the trials to judge by.
        free_runs: of the same trials, whole.
        offsets: joint offsets of all initialisations that are known by now [rad].
        candidates: what may be missing, but for what starts from a residual.
    """

    def __init__(
        self,
        fitted: Recording,
        held_out: Recording,
        noise: Array,
        effects: Sequence[type[Effect]],
        say: Callable[[str], None],
        known: ModelFile | None = None,
        criteria: Criteria = STANDARD,
        segments: int = SEGMENTS,
    ) -> None:
        """Prepare the problems.

        Args:
            fitted: trials to fit.
            held_out: trials to judge by.
            noise: (n,) of the position sensors [rad].
            effects: classes to search.
            say: takes progress lines.
            known: the model to begin with; None: what the recording's owner states.
            criteria: what decides.
            segments: how many of them to judge by, at most as many to fit.
        """
        self.fitted, self.held_out, self.noise, self.known, self.criteria = fitted, held_out, noise, known, criteria
        self.say = say if isinstance(say, BestSoFar) else BestSoFar(say)
        self.start, self.start_held_out = nominal_model(fitted, known), nominal_model(held_out, known)
        self.effects = every_effect(effects, self.start)
        self.shooting = Shooting(fitted, self.effects)
        usual = self.shooting.cut(fitted, noise)
        rows = sum(np.count_nonzero(trial.valid) for trial in held_out.trials)
        steady = steady_rows(self.shooting, self.start, some(usual, segments))
        self.segment = min(steady, max(FEWEST_ROWS, int(rows) // ENOUGH))
        self.segments = min(segments, segments * usual.segment // self.segment)
        self.all_windows = self.windows(fitted)
        self.problem = Problem(self.shooting, some(self.all_windows, self.segments // FITTED))
        self.validation = Problem(self.shooting, some(self.windows(held_out), self.segments))
        self.offsets = dict(self.start_held_out.offsets)
        self.free_runs = HeldOut(self.shooting, held_out, noise, self.offsets)
        self.candidates = candidates(self.shooting.sizes, self.effects)
        self.least = math.inf  # error of the best set so far on fitted trials [sensor noise]

    @cached_property
    def base(self) -> Explanation:
        """Refitted constants alone; as they are stated where that follows the held-out trials better."""
        self.problem.linearise_starts(self.start)
        first = fit(self.problem, self.start, self.unknowns(self.start), iterations=4)
        self.problem.linearise_starts(first.model)
        second = fit(self.problem, first.model, first.unknowns, iterations=3)
        if self.free_runs.worse(second.model, self.start):
            self.problem.linearise_starts(self.start)
            second = fit(self.problem, self.start, first.unknowns, iterations=0)
        judgement = self.judged(second.model)
        self.offsets = dict(judgement.model.offsets)
        return Explanation((), second, judgement, 1.0, 0.0)

    def windows(self, recording: Recording) -> Windows:
        """Other trials cut likewise."""
        return self.shooting.cut(recording, self.noise, segment=self.segment)

    def unknowns(self, model: Model) -> tuple[Unknown, ...]:
        """Everything that a refit of the model may change."""
        sizes = self.shooting.sizes
        return (*base_unknowns(self.fitted, self.start.constants, sizes), *model_unknowns(model, sizes))

    def frozen(self, fitted: Fit) -> Fit:
        """A fit with its residual and columns taken anew on this problem, to build on."""
        self.problem.linearise_starts(fitted.model)
        prediction, columns = self.problem.columns(fitted.model, fitted.unknowns)
        return renewed(self.problem, fitted, prediction, columns)

    def refit(
        self, frozen: Fit, candidate: Candidate, iterations: int = 6, model: Model | None = None
    ) -> tuple[Candidate, Fit]:
        """Fit a candidate's numbers beside the frozen columns of its parent, started from `model` or the parent's."""
        model, unknowns = candidate.added_to(model or frozen.model)
        return candidate, fit(self.problem, model, unknowns, iterations, frozen=frozen)

    def refitted(self, model: Model) -> Fit:
        """A model with everything that it has fitted, its starts taken anew as long as that helps."""
        self.problem.linearise_starts(model)
        fitted = fit(self.problem, model, self.unknowns(model), LONG)
        for _ in range(RENEWED):
            before = fitted
            self.problem.linearise_starts(before.model)
            fitted = fit(self.problem, before.model, before.unknowns, LONG)
            if fitted.cost > HELPS * before.cost:
                break
        return fitted

    def over_noise(self, fitted: Fit) -> float:
        """RMS error of a fit in units of the sensor noise."""
        return float(np.sqrt(fitted.cost / np.count_nonzero(self.problem.weight)))

    def judged(self, model: Model) -> Judgement:
        """How a model does on the held-out trials."""
        found = model.with_offsets(self.offsets)
        self.validation.linearise_starts(found)
        return judge(self.validation, self.held_out, found)

    def stand(self, answer: str, following: str) -> None:
        """Note the best answer so far and what is tried next, in words."""
        self.say.answer, self.say.following = answer, following

    @property
    def following(self) -> str:
        """What is tried next, in words."""
        return self.say.following

    @property
    def spent(self) -> bool:
        """Whether the search has simulated as much as it may."""
        return self.shooting.simulated > self.criteria.most_simulated

    def new(self, wanted: Sequence[Candidate]) -> list[Candidate]:
        """Without effects that the model to begin with has at that joint already."""
        known = {(term.effect, term.joint) for term in self.start.terms}
        return [one for one in wanted if not any((one.effect, joint) in known for joint in one.joints)]

    def explained(self, one: Proposal, looked_at: int) -> Explanation:
        """A fitted set on the held-out trials, of which it is one of so many that were looked at."""
        judgement = self.judged(one.fit.model)
        chance = min(1.0, p_value(self.base.judgement, judgement) * looked_at)
        found = Explanation(one.effects, one.fit, judgement, chance, gain(self.base.judgement, judgement))
        self.say(f"  held-out error {found.error:.3f}  {found.label}")
        return found


def some(windows: Windows, segments: int) -> Windows:
    """Windows of about so many segments, spread over trials and over the time within trials."""
    return windows.take(np.sort(spread(windows.trial, -(-segments // windows.segments))))


def spread(trial: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Places of so many windows, spread over their trials and over the time within trials."""
    by_trial = [np.flatnonzero(trial == k) for k in np.unique(trial)]
    order = [
        int(rows[(turn + k) % len(rows)])
        for turn in range(max((len(rows) for rows in by_trial), default=0))
        for k, rows in enumerate(by_trial)
        if turn < len(rows)
    ]
    return np.array(order[:count], dtype=np.int64)


def steady_rows(shooting: Shooting, model: Model, windows: Windows) -> int:
    """Rows of a segment, at most those of the windows', within which an error of its start grows `GROWN` times at most.

    A pendulum about its upper rest makes a hundred out of one within a second, and no fit is judged by what is left.
    The model tells its own growth: the derivative of each joint's position by its position at the segment's start.
    """
    joints = len(shooting.recording.joints)
    slopes = shooting.start_sensitivity(model, windows)[:joints]
    own = np.stack([np.abs(slopes[j, :, :, j]) for j in range(joints)], axis=-1)
    measured = (windows.weight > 0.0).any(axis=-1).reshape(-1, windows.segment)
    growth = np.where(measured, own.max(axis=-1).reshape(-1, windows.segment), np.nan)
    known = np.isfinite(growth).any(axis=0)
    mostly = np.zeros(windows.segment)
    mostly[known] = np.nanquantile(growth[:, known], MOSTLY, axis=0)
    grown = np.flatnonzero(mostly > GROWN)
    return max(int(grown[0]), min(FEWEST_ROWS, windows.segment)) if len(grown) else windows.segment
