"""Trials to fit and trials to judge by: a model fitted on the ones and judged on the others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.fitting.base import base_unknowns
from tactile_cube.identification.fitting.gauss_newton import Fit, fit, renewed
from tactile_cube.identification.fitting.held_out import HeldOut
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.identification.search.candidates import Candidate, model_unknowns
from tactile_cube.identification.search.evidence import Judgement, judge
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.nominal import nominal_model
from tactile_cube.measurement.replay.windows import Windows

Array = NDArray[np.float64]
BRIEF, LONG = 3, 8  # most iterations of a brief refit and of a long one; a fit that converges ends before
SEGMENTS = 132  # enough data to judge by, 52.8 s of a finger; the final fit takes all
RENEWED, HELPS = (
    3,
    0.98,
)  # times that starts are taken anew, and squared error over the last one's with which it goes on
FITTED = 2  # part of as many that a refit of a search takes: no answer was lost by it, and half the time saved


class Division:
    """A recording's trials divided in two.

    Attributes:
        shooting: simulates both parts.
        fitted: the trials to fit.
        held_out: the trials to judge by.
        start: the model to begin with, of the trials to fit; `start_held_out` of the others.
        all_windows: of the trials to fit; `problem` takes as many of them as a search needs.
        validation: the problem of the trials to judge by.
        free_runs: of the same trials, whole.
        offsets: joint offsets of all initialisations that are known by now [rad].
    """

    def __init__(
        self,
        shooting: Shooting,
        fitted: Recording,
        held_out: Recording,
        noise: Array,
        segment: int | None = None,
        known: ModelFile | None = None,
        segments: int = SEGMENTS,
    ) -> None:
        """Prepare the problems.

        Args:
            shooting: with all effects compiled in.
            fitted: trials to fit.
            held_out: trials to judge by.
            noise: (n,) of the position sensors [rad].
            segment: rows of a segment; as long as identification likes them by default.
            known: the model to begin with; None: what the recording's owner states.
            segments: how many of them a search takes, of either part.
        """
        self.shooting, self.fitted, self.held_out = shooting, fitted, held_out
        self.noise, self.segment, self.known, self.segments = noise, segment, known, segments
        self.start, self.start_held_out = nominal_model(fitted, known), nominal_model(held_out, known)
        self.all_windows = self.windows(fitted)
        self.rows = self.all_windows.segment
        self.problem = Problem(shooting, some(self.all_windows, segments // FITTED))
        self.validation = Problem(shooting, some(self.windows(held_out), segments))
        self.offsets = dict(self.start_held_out.offsets)
        self.free_runs = HeldOut(shooting, held_out, noise, self.offsets)

    def windows(self, recording: Recording) -> Windows:
        """Other trials cut likewise."""
        return self.shooting.cut(recording, self.noise, segment=self.segment)

    def fit_base(self) -> Explanation:
        """Refit what the model already has; as it is stated where that follows the held-out trials better."""
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


def some(windows: Windows, segments: int) -> Windows:
    """Windows of about so many segments, spread over trials and over the time within trials."""
    by_trial = [np.flatnonzero(windows.trial == k) for k in np.unique(windows.trial)]
    order = [
        int(rows[(turn + k) % len(rows)])
        for turn in range(max(len(rows) for rows in by_trial))
        for k, rows in enumerate(by_trial)
        if turn < len(rows)
    ]
    return windows.take(np.array(sorted(order[: -(-segments // windows.segments)])))
