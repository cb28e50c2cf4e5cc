"""Choose the window length and mask disturbed intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.criteria import Criteria
from tactile_cube.identification.disturbances import Disturbance, disturbances, undisturbed
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.findings import Findings, among, find
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.verdict import Simulations, Verdict, decide
from tactile_cube.measurement.comparing.noise_floor import noise_floor, noise_with_links
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.simulator import Engine
from tactile_cube.measurement.split import held_out_split, turned, with_test_part

MOST_STRETCHES = 12
"""That follow no model; with so many found, no more are looked for: each time all is searched anew."""
LONGER = 4
"""Times as long as usual that segments are where the usual ones leave much: what a start misread, as where a joint
sticks within a sample, is a smaller part of them."""
NOT_ALL = ("unknown_effect", "partly_explained")
"""Verdicts that say that more is missing than is named."""
LESS = (*NOT_ALL, "ambiguous")
"""Verdicts that do not say what is missing and that it is all, the one that says least first."""
AMBIGUOUS = (LESS.index("ambiguous"), True)
"""What an answer says that names all that may be, and leaves little."""
ALL = (len(LESS), True)
"""What an answer says that names all, and leaves little."""


class Answer(NamedTuple):
    """A verdict and what it came from."""

    search: Search
    findings: Findings
    simulations: Simulations
    verdict: Verdict

    @property
    def says(self) -> tuple[int, bool]:
        """How much it says, to be compared: how nearly it names all that is missing, then whether little is left."""
        little_left = self.verdict.chosen.largest_error <= self.search.criteria.tolerated
        return (LESS.index(self.verdict.kind) if self.verdict.kind in LESS else len(LESS)), little_left


@dataclass(frozen=True)
class Inquiry:
    """A recording, and how it is asked.

    Attributes:
        recording: two or more trials.
        effects: the catalogue to search.
        engine: of the free-running errors that decide.
        step: its simulation step [s].
        seed: which trials are held out, and which test.
        say: takes progress lines.
        known: the model to begin with; None: what the recording's owner states.
        criteria: what decides.
        known_answer: explanations that are asked of first; all others only where those are not the whole of it.
        finer: times as short are the steps of simulation that its sensors call for.
    """

    recording: Recording
    effects: Sequence[type[Effect]]
    engine: Engine
    step: float
    seed: int
    say: Callable[[str], None]
    known: ModelFile | None
    criteria: Criteria
    known_answer: tuple[Explanation, ...] = ()
    finer: int = 1

    @cached_property
    def parts(self) -> tuple[Recording, Recording, Recording | None]:
        """The trials to fit, those to judge by, and those that only test, if there are enough."""
        fitted, held_out = held_out_split(self.recording, seed=self.seed)
        fitted, tested = with_test_part(fitted, len(self.recording.trials), self.seed)
        return fitted, held_out, tested

    @cached_property
    def search(self) -> Search:
        """In segments as long as usual."""
        return self.search_in(1)

    def search_in(self, longer: int) -> Search:
        """In segments so many times as long as usual."""
        fitted, held_out, _ = self.parts
        asked = (self.effects, self.say, self.known, self.criteria, turned(fitted, held_out), longer, self.finer)
        return Search(fitted, held_out, noise_with_links(self.recording), *asked)

    @cached_property
    def answer(self) -> Answer:
        """What is found, in usual segments or longer ones."""
        if self.known_answer and (first := self.answered(self.search, self.known_answer)).says >= AMBIGUOUS:
            return first
        return asked(self.first, self.search_in, self.answered, self.say)

    @cached_property
    def first(self) -> Answer:
        """What is found in usual segments."""
        return self.answered(self.search)

    def answered(self, search: Search, known: Sequence[Explanation] = ()) -> Answer:
        """What one search finds, or says of explanations that are `known`."""
        findings = among(search, known) if known else find(search)
        simulations = Simulations(search, findings.base, noise_floor(self.recording), self.engine, self.step)
        return Answer(search, findings, simulations, decide(findings, simulations, self.criteria))


class Inquired(NamedTuple):
    """What was asked in the end, what counts in nothing of it, and what may be such a stretch too."""

    inquiry: Inquiry
    left_out: tuple[Disturbance, ...] = ()
    suspected: tuple[Disturbance, ...] = ()


def beside_disturbances(inquiry: Inquiry) -> Inquired:
    """A recording asked without the stretches that follow no model, as when somebody pushes the arm.

    A stretch is left out where other runs of its command show nothing of it at that time; most stand out beside the
    model with refitted constants already. What was played once may as well be a law that shows nowhere else; it is
    left out where only so all that is missing can be named.
    """
    left_out: tuple[Disturbance, ...] = ()
    while len(left_out) < MOST_STRETCHES:
        recording = inquiry.recording
        found = [one for one in disturbances(inquiry.search, recording, inquiry.search.base.fit.model) if one.repeats]
        if not found:
            answer = inquiry.answer
            found = disturbances(answer.search, recording, answer.simulations.final(answer.verdict.chosen).model)
            found = [one for one in found if one.repeats] or found
        proven = any(one.repeats for one in found)
        if not found or (not proven and inquiry.answer.says == ALL):
            break
        for one in found:
            inquiry.say(
                f"{one.trial} follows no model from {one.start:.2f} to {one.end:.2f} s ({one.joint}: {one.error:.0f} x "
                "sensor noise); once more without"
            )
        without = replace(inquiry, recording=undisturbed(recording, found))
        if not proven and without.answer.says <= inquiry.answer.says:
            return Inquired(inquiry, left_out, tuple(found))
        inquiry, left_out = without, (*left_out, *found)
    return Inquired(inquiry, left_out)


def asked(
    first: Answer,
    search_in: Callable[[int], Search],
    answered: Callable[[Search, Sequence[Explanation]], Answer],
    say: Callable[[str], None],
) -> Answer:
    """The answer of a search in usual segments, or in longer ones, where only those name all that is missing.

    Where much is left, or several laws do as well, a misread start is a smaller part of a longer segment, and what is
    slower shows. Where nothing is left, but free runs are further from the measurement than it is from itself, starts
    that are fitted hide what is slower than a segment.

    Args:
        first: what the search in usual segments found.
        search_in: prepares one in segments so many times as long as usual.
        answered: runs it, or judges those explanations only.
        say: takes progress lines.
    """
    base, criteria = first.findings.base, first.search.criteria
    nothing_left = base.largest_error <= criteria.floor
    if first.simulations.as_repeats(base) if nothing_left else first.says == ALL:
        return first
    if not first.findings.levels and base.error > criteria.far:
        return first  # short segments show plenty of what nothing explains
    longer = search_in(LONGER)
    if longer.rows <= first.search.rows:
        return first
    say(f"{first.verdict.kind}; once more in segments of {longer.rows} samples instead of {first.search.rows}")
    if nothing_left:
        return first if longer.base.largest_error <= criteria.adequate else answered(longer, ())
    told_apart = (first.verdict.chosen, *first.verdict.rivals) if first.verdict.kind == "ambiguous" else ()
    second = answered(longer, told_apart)
    return second if second.verdict.kind not in NOT_ALL and second.says > first.says else first
