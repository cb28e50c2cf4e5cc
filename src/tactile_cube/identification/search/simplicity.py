"""Which of several explanations that follow the data as well is the simplest."""

from __future__ import annotations

from collections.abc import Sequence

from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.evidence import gain, worse
from tactile_cube.identification.search.explanation import Explanation


def simplest(found: Sequence[Explanation], criteria: Criteria = STANDARD) -> Explanation:
    """The explanation with the fewest effects, then numbers, among those that are as good as the best."""
    best = min(found, key=lambda e: e.judgement.costs.sum())
    equal = [e for e in found if not worse(e.judgement, best.judgement, criteria)]
    equal += [e for e in found if any(_but_for_a_detail(e, richer, criteria) for richer in equal)]
    return min(equal, key=lambda e: (len(named(e)), e.size, e.judgement.costs.sum()))


def _but_for_a_detail(simple: Explanation, richer: Explanation, criteria: Criteria) -> bool:
    """Whether the last effect is a special case of the richer one's, which explains next to nothing more.

    Over many samples the least deviation of anything else in the model is significant.
    """
    if not contains(richer, simple):
        return False
    small = richer.gain - simple.gain < criteria.detail * richer.gain
    return small and gain(simple.judgement, richer.judgement) < criteria.least_gain


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
