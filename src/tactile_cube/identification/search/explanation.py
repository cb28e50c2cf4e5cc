"""Sets of effects: significance, completeness, and the choice of the simplest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.evidence import Judgement, gain, lacking, worse


@dataclass(frozen=True)
class Proposal:
    """Set of effects fitted to the training trials; held-out trials are not used.

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
        """Return the squared error with a penalty for each parameter."""
        return priced(self.fit.cost, self.effects, criteria)


def priced(cost: float, effects: Sequence[Candidate], criteria: Criteria) -> float:
    """Return a squared error with a penalty of `least_gain` for each parameter."""
    return float(cost / (1.0 - criteria.least_gain) ** sum(one.size for one in effects))


@dataclass(frozen=True)
class Explanation(Proposal):
    """Proposal that was scored on the held-out trials.

    Attributes:
        judgement: on the held-out trials.
        p_value: against the base model, corrected for the number of laws screened.
        gain: share of the held-out squared error that it explains.
    """

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
        """Number of parameters beyond the base, initial states included."""
        return sum(c.size + len(c.joints) * c.effect.chosen_starts for c in self.effects)

    @property
    def terms(self) -> int:
        """Number of terms that it adds to the model."""
        return sum(len(c.joints) for c in self.effects)

    def explained(self, base: Explanation) -> float:
        """Return the share of another model's excess error over the sensor noise that this one explains."""
        return (base.error**2 - self.error**2) / max(base.error**2 - 1.0, 1e-9)


def simplest(found: Sequence[Explanation], criteria: Criteria = STANDARD) -> Explanation:
    """Return the explanation with the fewest effects, then parameters, among those as good as the best."""
    best = min(found, key=lambda e: e.judgement.costs.sum())
    equal = [e for e in found if not worse(e.judgement, best.judgement, criteria)]
    return min(equal, key=lambda e: (len(named_by(e.effects)), e.size, e.judgement.costs.sum()))


def sound(
    found: Sequence[Explanation], base: Explanation, criteria: Criteria = STANDARD, looked_at: int = 1
) -> list[Explanation]:
    """Return the explanations that no subset shows to have a needless effect and no superset to lack one.

    Significance is corrected for the number of laws screened. An effect added to a complete set has to explain most of
    the rest: where a law differs in form from the machine, many others explain a part of what it leaves.
    """

    def refuted(one: Explanation, other: Explanation) -> bool:
        if named_by(one.effects) < named_by(other.effects):
            return lacking(one.judgement, other.judgement, criteria, looked_at) and not in_detail(other, one)
        if named_by(other.effects) < named_by(one.effects):
            return gain(other.judgement, one.judgement) < criteria.least_gain or in_detail(one, other)
        return False

    def in_detail(more: Explanation, less: Explanation) -> bool:
        return complete(less, base, criteria) and more.explained(less) < criteria.most

    kept = [one for one in found if not any(refuted(one, other) for other in found)]
    # along a chain of sets each may be refuted by another one
    return kept or sorted(found, key=lambda one: one.judgement.costs.sum())[:1]


def contains(richer: Explanation, simple: Explanation) -> bool:
    """Return whether two explanations differ only in their last effects, one a special case of the other."""
    if not simple.effects or named_by(simple.effects[:-1]) != named_by(richer.effects[:-1]):
        return False
    last, special = richer.effects[-1], simple.effects[-1]
    return special.effect.name in last.effect.contains and special.joints == last.joints


def named_by(effects: Sequence[Candidate]) -> frozenset[tuple[str, str]]:
    """Return the (effect, joint) pairs of candidates, whatever their form."""
    return frozenset((c.effect.name, joint) for c in effects for joint in c.joints)


def proven(explanation: Explanation, criteria: Criteria = STANDARD) -> bool:
    """Return whether a set is a large and significant improvement on held-out trials."""
    return explanation.gain >= criteria.least_gain and explanation.p_value <= criteria.significant


def complete(explanation: Explanation, base: Explanation, criteria: Criteria = STANDARD) -> bool:
    """Return whether a set leaves so little error that nothing more is missing."""
    share = explanation.explained(base)
    little = explanation.largest_error <= criteria.tolerated or share > criteria.nearly_whole
    return little and (explanation.error <= criteria.adequate or share >= criteria.most)


def nameable(explanation: Explanation, base: Explanation, criteria: Criteria = STANDARD) -> bool:
    """Return whether a set explains enough to be named, completely or in part."""
    return complete(explanation, base, criteria) or explanation.explained(base) >= criteria.most


def unproven(explanation: Explanation, criteria: Criteria = STANDARD) -> bool:
    """Return whether a set is a large improvement that is not significant."""
    return explanation.gain > criteria.detail and not proven(explanation, criteria)


def at_bound(one: Proposal) -> bool:
    """Return whether a parameter of its effects is at a bound that is not its neutral value.

    The law then imitates another one, as a wave longer than the range of motion imitates any curve.
    """
    model, added = one.fit.model, sum(len(effect.joints) for effect in one.effects)
    return any(
        math.isclose(unknown.of(model), edge, rel_tol=1e-6) and edge != unknown.neutral
        for unknown in one.fit.unknowns
        if unknown.kind == "effect" and unknown.place >= len(model.terms) - added
        for edge in (unknown.low, unknown.high)
    )
