"""A recording divided in trials to fit and to judge by, and the laws that may be missing there."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.base import every_effect
from tactile_cube.identification.fitting.error_growth import steady_rows
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.identification.search.candidates import Candidate, candidates
from tactile_cube.identification.search.division import SEGMENTS, Division, some
from tactile_cube.identification.search.evidence import gain, p_value
from tactile_cube.identification.search.explanation import Explanation, Proposal
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.nominal import nominal_model

ENOUGH = 24  # held-out segments at least
FEWEST_ROWS = 8
FIRST_ANSWER = 10.0  # [s] after which the best answer so far is said, then after twice as long each time


def enough_rows(held_out: Recording) -> int:
    """Rows of a segment at most, so that the held-out trials have enough of them for a test."""
    rows = sum(np.count_nonzero(trial.valid) for trial in held_out.trials)
    return max(FEWEST_ROWS, int(rows) // ENOUGH)


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


class Search(Division):
    """A recording with its trials divided, and the effects that may be missing."""

    def __init__(
        self,
        fitted: Recording,
        held_out: Recording,
        noise: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
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
            segments: how many of them to judge by.
        """
        start = nominal_model(fitted, known)
        effects = every_effect(effects, start)
        shooting = Shooting(fitted, effects)
        usual = shooting.cut(fitted, noise)
        segment = min(steady_rows(shooting, start, some(usual, segments)), enough_rows(held_out))
        segments = min(segments, segments * usual.segment // segment)
        super().__init__(shooting, fitted, held_out, noise, segment, known, segments)
        self.say = say if isinstance(say, BestSoFar) else BestSoFar(say)
        self.criteria, self.effects = criteria, effects
        self.candidates = candidates(shooting.sizes, effects)

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

    @cached_property
    def base(self) -> Explanation:
        """Refitted constants alone."""
        return self.fit_base()

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
