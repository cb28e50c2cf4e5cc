"""Search problem: a recording split into fitted and held-out trials, and the candidate laws."""

import math
import time
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.effect import Array, Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit, fit
from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.identification.fitting.unknowns import Unknown, base_unknowns, every_effect
from tactile_cube.identification.search.candidates import Candidate, candidates, model_unknowns
from tactile_cube.identification.search.evidence import HeldOut, Judgement, gain, judge, p_value
from tactile_cube.identification.search.explanation import Explanation, Proposal
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, nominal_model
from tactile_cube.measurement.replay.windows import Windows

LONG = 8  # most iterations of a refit; one that converges ends before
SEGMENTS = 132  # enough data to judge by, 52.8 s of a finger; the final fit takes all
RENEWED, HELPS = 3, 0.98  # times that starts are taken anew, and part of the squared error that has to be left for that
FITTED = 2  # a refit within the search takes one segment in so many, which saves half the time
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
    """Recording with its trials split in two, and the effects that may be missing.

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
        fits: the best fit of each set that was refitted, by its laws, joints and forms.
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
        self.fits: dict[frozenset[tuple[str, tuple[str, ...], tuple[str, ...]]], Proposal] = {}
        self.least = math.inf  # price of the best set so far on fitted trials

    @cached_property
    def base(self) -> Explanation:
        """Model with refitted constants, or as stated if that predicts the held-out trials better.

        Where it fails, `problem` takes the windows in which it fails most: rare failures may be in none of the others.
        """
        found = self.fitted_base()
        if found.largest_error <= self.criteria.adequate:
            return found
        every, model = Problem(self.shooting, self.all_windows), found.fit.model
        every.linearise_starts(model)
        costs = every.cost(every.residual(every.prediction(model)))
        self.problem = Problem(self.shooting, failing(self.all_windows, costs, self.segments // FITTED))
        return self.fitted_base()

    def fitted_base(self) -> Explanation:
        """Refit the constants on the windows of `problem`; keep what is stated if that does better."""
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
        """Return shooting windows of other trials, cut in the same way."""
        return self.shooting.cut(recording, self.noise, segment=self.segment)

    def unknowns(self, model: Model) -> tuple[Unknown, ...]:
        """Return the free parameters of a full refit."""
        sizes = self.shooting.sizes
        return (*base_unknowns(self.fitted, self.start.constants, sizes), *model_unknowns(model, sizes))

    def frozen(self, fitted: Fit) -> Fit:
        """Return a fit with residual and columns updated on this problem."""
        self.problem.linearise_starts(fitted.model)
        return fit(self.problem, fitted.model, fitted.unknowns, iterations=0)

    def cost(self, model: Model) -> float:
        """Return the squared error of a model on the fitted windows, linearising initial states anew."""
        self.problem.linearise_starts(model)
        return float(self.problem.cost(self.problem.residual(self.problem.prediction(model))).sum())

    def refitted(self, model: Model) -> Fit:
        """Refit a model completely, linearising initial states anew as long as that helps; it fits no worse after."""
        unknowns, begun = self.unknowns(model), self.cost(model)
        found: list[Fit] = []
        for _ in range(1 + RENEWED):
            reached = fit(self.problem, found[-1].model if found else model, unknowns, LONG)
            self.problem.linearise_starts(reached.model)
            found.append(fit(self.problem, reached.model, (), 0, reached))
            if reached.settled and abs(found[-1].cost - reached.cost) < (1.0 - HELPS) * reached.cost:
                break
            if len(found) > 1 and found[-1].cost > HELPS * found[-2].cost:
                break
        best = min(found, key=lambda one: one.cost)
        if best.cost <= begun:
            return best
        self.problem.linearise_starts(model)
        return fit(self.problem, model, unknowns, iterations=0)

    def over_noise(self, fitted: Fit) -> float:
        """Return the RMS error of a fit in units of the sensor noise."""
        return float(np.sqrt(fitted.cost / np.count_nonzero(self.problem.weight)))

    def judged(self, model: Model) -> Judgement:
        """Return the error of a model on the held-out trials."""
        found = model.with_offsets(self.offsets)
        self.validation.linearise_starts(found)
        return judge(self.validation, self.held_out, found)

    def stand(self, answer: str, following: str) -> None:
        """Note the best answer so far and the next step, in words."""
        self.say.answer, self.say.following = answer, following

    @property
    def following(self) -> str:
        """Next step, in words."""
        return self.say.following

    @property
    def spent(self) -> bool:
        """Whether the simulation budget is used up."""
        return self.shooting.simulated > self.criteria.most_simulated

    def new(self, wanted: Sequence[Candidate]) -> list[Candidate]:
        """Return candidates without effects that the initial model has at the same joint."""
        known = {(term.effect, term.joint) for term in self.start.terms}
        return [one for one in wanted if not any((one.effect, joint) in known for joint in one.joints)]

    def explained(self, one: Proposal, looked_at: int) -> Explanation:
        """Score a fitted set on the held-out trials, its p-value corrected for the number of laws screened."""
        judgement = self.judged(one.fit.model)
        chance = min(1.0, p_value(self.base.judgement, judgement) * looked_at)
        found = Explanation(one.effects, one.fit, judgement, chance, gain(self.base.judgement, judgement))
        self.say(f"  held-out error {found.error:.3f}  {found.label}")
        return found


def some(windows: Windows, segments: int) -> Windows:
    """Return windows of about so many segments, spread over trials and over the time within trials."""
    return windows.take(np.sort(spread(windows.trial, -(-segments // windows.segments))))


def failing(windows: Windows, costs: Array, segments: int) -> Windows:
    """Return windows of about so many segments: half with the largest costs (G,), half spread over the others."""
    wanted = -(-segments // windows.segments)
    of_window = costs.reshape(-1, windows.segments).sum(axis=1)
    worst = np.argsort(-of_window, kind="stable")[: wanted // 2]
    others = np.setdiff1d(np.arange(len(of_window)), worst)
    return windows.take(np.sort(np.concatenate([worst, others[spread(windows.trial[others], wanted - len(worst))]])))


def spread(trial: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return indices of so many windows, spread over their trials and over the time within trials."""
    by_trial = [np.flatnonzero(trial == k) for k in np.unique(trial)]
    order = [
        int(rows[(turn + k) % len(rows)])
        for turn in range(max((len(rows) for rows in by_trial), default=0))
        for k, rows in enumerate(by_trial)
        if turn < len(rows)
    ]
    return np.array(order[:count], dtype=np.int64)


def steady_rows(shooting: Shooting, model: Model, windows: Windows) -> int:
    """Return the longest segment, in rows, over which an initial-state error grows at most `GROWN` times.

    About its upper rest a pendulum multiplies an error a hundredfold within a second. The growth is the derivative of
    each joint's position by its position at the start of the segment.
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
