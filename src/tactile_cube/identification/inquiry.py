"""Mask disturbed intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.criteria import Criteria
from tactile_cube.identification.disturbances import Disturbance, disturbances, undisturbed
from tactile_cube.identification.search.findings import Findings, find
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.verdict import Simulations, Verdict, decide
from tactile_cube.measurement.comparing.noise_floor import noise_floor, noise_with_links
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.split import held_out_split, with_test_part

MOST_STRETCHES = 12
"""That follow no model; with so many found, no more are looked for: each time all is searched anew."""
NOT_ALL = ("unknown_effect", "partly_explained")
"""Verdicts that say that more is missing than is named."""
LESS = (*NOT_ALL, "ambiguous")
"""Verdicts that do not say what is missing and that it is all, the one that says least first."""
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
        seed: which trials are held out, and which test.
        say: takes progress lines.
        known: the model to begin with; None: what the recording's owner states.
        criteria: what decides.
    """

    recording: Recording
    effects: Sequence[type[Effect]]
    seed: int
    say: Callable[[str], None]
    known: ModelFile | None
    criteria: Criteria

    @cached_property
    def parts(self) -> tuple[Recording, Recording, Recording | None]:
        """The trials to fit, those to judge by, and those that only test, if there are enough."""
        fitted, held_out = held_out_split(self.recording, seed=self.seed)
        fitted, tested = with_test_part(fitted, len(self.recording.trials), self.seed)
        return fitted, held_out, tested

    @cached_property
    def search(self) -> Search:
        """The trials divided."""
        fitted, held_out, _ = self.parts
        asked = (self.effects, self.say, self.known, self.criteria)
        return Search(fitted, held_out, noise_with_links(self.recording), *asked)

    @cached_property
    def answer(self) -> Answer:
        """What is found."""
        search = self.search
        findings = find(search)
        simulations = Simulations(search, findings.base, noise_floor(self.recording))
        return Answer(search, findings, simulations, decide(findings, self.criteria))


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
