"""A set of effects that may be what is missing, fitted and judged."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.evidence import Judgement
from tactile_cube.measurement.replay.model import Model

NEARLY = 1.5  # the same of a fit before everything is free


@dataclass(frozen=True)
class Explanation:
    """A set of effects with everything refitted.

    Attributes:
        effects: candidates in the order in which they were added.
        fit: on the fitted trials.
        judgement: on the held-out trials.
        p_value: of the last effect, corrected for the number of effects that were judged beside it.
        gain: held-out share that the last effect explains.
    """

    effects: tuple[Candidate, ...]
    fit: Fit = field(repr=False)
    judgement: Judgement = field(repr=False)
    p_value: float
    gain: float

    @property
    def error(self) -> float:
        """Held-out error in units of the sensor noise."""
        return self.judgement.error

    @property
    def largest_error(self) -> float:
        """The same of the joint where it is largest, which the mean over many joints hides."""
        return max(self.error, float(self.judgement.joint_errors.max()))

    @property
    def label(self) -> str:
        """Readable."""
        return " & ".join(c.label for c in self.effects) or "base"

    @property
    def size(self) -> int:
        """Numbers fitted beyond the base, those of a state's start among them."""
        return sum(c.size + len(c.joints) * c.effect.chosen_starts for c in self.effects)

    @property
    def terms(self) -> int:
        """How many of the model's terms it adds to those that were known before."""
        return sum(len(c.joints) for c in self.effects)

    def explained(self, base: Explanation) -> float:
        """Share of the base model's excess over the sensor noise that is explained."""
        return (base.error**2 - self.error**2) / max(base.error**2 - 1.0, 1e-9)


def first_term(model: Model, effects: Sequence[Candidate], place: int) -> int:
    """Which of a model's terms, the last of which are those of `effects`, is the first one of an effect."""
    known = len(model.terms) - sum(len(candidate.joints) for candidate in effects)
    return known + sum(len(candidate.joints) for candidate in effects[:place])


def without_effect(model: Model, effects: Sequence[Candidate], place: int) -> Model:
    """A fitted model, whose last terms are those of `effects`, without one of them."""
    first = first_term(model, effects, place)
    return replace(model, terms=(*model.terms[:first], *model.terms[first + len(effects[place].joints) :]))


def fewer_joints(
    model: Model, effects: Sequence[Candidate], place: int
) -> Iterator[tuple[tuple[Candidate, ...], Model]]:
    """Where one of `effects` acts at several joints: the effects and the fitted model without it at one of them."""
    candidate, first = effects[place], first_term(model, effects, place)
    for k, joint in enumerate(candidate.joints if len(candidate.joints) > 1 else ()):
        left = replace(candidate, joints=tuple(other for other in candidate.joints if other != joint))
        terms = (*model.terms[: first + k], *model.terms[first + k + 1 :])
        yield (*effects[:place], left, *effects[place + 1 :]), replace(model, terms=terms)
