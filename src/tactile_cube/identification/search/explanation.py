"""A set of effects that may be what is missing: when it earns its place, and which of several is the simplest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.evidence import Judgement, gain, lacking, worse


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


def simplest(found: Sequence[Explanation], criteria: Criteria = STANDARD) -> Explanation:
    """The explanation with the fewest effects, then numbers, among those that are as good as the best."""
    best = min(found, key=lambda e: e.judgement.costs.sum())
    equal = [e for e in found if not worse(e.judgement, best.judgement, criteria)]
    return min(equal, key=lambda e: (len(named(e)), e.size, e.judgement.costs.sum()))


def sound(
    found: Sequence[Explanation], base: Explanation, criteria: Criteria = STANDARD, looked_at: int = 1
) -> list[Explanation]:
    """Explanations of which sets that differ from them by whole effects show none as missing and none as needless.

    What is missing may be any of the effects that were looked at. Where a set is complete, what comes to it has to take
    away most of the rest, as a law that is there does: laws that differ from the real thing in detail leave a rest of
    which others take a part.
    """

    def refuted(one: Explanation, other: Explanation) -> bool:
        if named(one) < named(other):
            return lacking(one.judgement, other.judgement, criteria, looked_at) and not in_detail(other, one)
        if named(other) < named(one):
            return gain(other.judgement, one.judgement) < criteria.least_gain or in_detail(one, other)
        return False

    def in_detail(more: Explanation, less: Explanation) -> bool:
        return complete(less, base, criteria) and more.explained(less) < criteria.most

    return [one for one in found if not any(refuted(one, other) for other in found)]


def contains(richer: Explanation, simple: Explanation) -> bool:
    """Whether two explanations differ in the last effect alone, and one's is a special case of the other's."""
    if not simple.effects or named_by(simple.effects[:-1]) != named_by(richer.effects[:-1]):
        return False
    last, special = richer.effects[-1], simple.effects[-1]
    return special.effect.name in last.effect.contains and special.joints == last.joints


def named(explanation: Explanation) -> frozenset[tuple[str, str]]:
    """The (effect, joint) pairs of an explanation, whatever their form."""
    return named_by(explanation.effects)


def named_by(effects: Sequence[Candidate]) -> frozenset[tuple[str, str]]:
    """The same of single effects."""
    return frozenset((c.effect.name, joint) for c in effects for joint in c.joints)


def proven(explanation: Explanation, criteria: Criteria = STANDARD) -> bool:
    """Whether a set explains enough, and held-out segments tell it from chance, all that was looked at counted."""
    return explanation.gain >= criteria.least_gain and explanation.p_value <= criteria.significant


def complete(explanation: Explanation, base: Explanation, criteria: Criteria = STANDARD) -> bool:
    """Whether a set leaves so little that nothing more is missing."""
    share = explanation.explained(base)
    little = explanation.largest_error <= criteria.tolerated or share > criteria.nearly_whole
    return little and (explanation.error <= criteria.adequate or share >= criteria.most)


def nameable(explanation: Explanation, base: Explanation, criteria: Criteria = STANDARD) -> bool:
    """Whether a set is the whole or at least a part of the truth; what explains less is unknown."""
    return complete(explanation, base, criteria) or explanation.explained(base) >= criteria.most


def unproven(explanation: Explanation, criteria: Criteria = STANDARD) -> bool:
    """Whether a set explains much, and that may be chance."""
    return explanation.gain > criteria.detail and not proven(explanation, criteria)


@dataclass(frozen=True)
class Proposal:
    """A set of effects and how it fits; no held-out trial has been asked.

    Attributes:
        effects: in the order in which they came.
        fit: of everything together.
    """

    effects: tuple[Candidate, ...]
    fit: Fit = field(repr=False)

    @property
    def label(self) -> str:
        """Readable."""
        return " & ".join(c.label for c in self.effects) or "the refitted model"

    def price(self, criteria: Criteria) -> float:
        """Squared error with the price of its numbers."""
        return priced(self.fit.cost, self.effects, criteria)


def priced(cost: float, effects: Sequence[Candidate], criteria: Criteria) -> float:
    """Squared error, with as much for each number as an effect has to explain at least."""
    return float(cost / (1.0 - criteria.least_gain) ** sum(one.size for one in effects))


def at_bound(one: Explanation | Proposal) -> bool:
    """Whether a number of its effects ends at its lower or upper bound.

    Then the law stands in for another one: so do waves longer than the range of motion for any bent curve.
    """
    model, added = one.fit.model, sum(len(effect.joints) for effect in one.effects)
    return any(
        math.isclose(unknown.of(model), edge, rel_tol=1e-6) and edge != unknown.neutral
        for unknown in one.fit.unknowns
        if unknown.kind == "effect" and unknown.place >= len(model.terms) - added
        for edge in (unknown.low, unknown.high)
    )
