"""From everything that was tried to an answer: adequate, missing_effect, ambiguous or unknown_effect."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tactile_cube.identification.evidence import p_value
from tactile_cube.identification.explanation import FLOOR, Explanation
from tactile_cube.identification.search import Findings

Kind = Literal["adequate", "missing_effect", "ambiguous", "unknown_effect"]
AS_GOOD = 1.05  # squared error of a rival over that of the best explanation that still counts as equal
AS_GOOD_ABOVE_FLOOR = 1.3  # the same where the best explanation does not reach the floor
TOLERATED = 1.6  # error / sensor noise up to which an explanation is complete
EXPLAINED, TOLERATED_IF_EXPLAINED = 0.98, 4.0  # share of the excess error, and the error, that a near miss may have
ADEQUATE = 1.3  # error / sensor noise of a model to which nothing significant can be added
SIGNIFICANT = 0.01


@dataclass(frozen=True)
class Verdict:
    """The answer.

    Attributes:
        kind: see issue and report.
        chosen: the recommended explanation; the base model where nothing is missing or known.
        rivals: explanations that this data cannot tell from the chosen one.
    """

    kind: Kind
    chosen: Explanation
    rivals: tuple[Explanation, ...] = ()


def decide(findings: Findings) -> Verdict:
    """The answer to what a search has found."""
    base = findings.base
    if not findings.levels:
        return Verdict("adequate" if base.error <= ADEQUATE else "unknown_effect", base)
    level = next((level for level in findings.levels if level[0].complete(base)), findings.levels[-1])
    chosen = simplest(level)
    near = chosen.explained(base) > EXPLAINED and chosen.error < TOLERATED_IF_EXPLAINED
    if chosen.error > TOLERATED and not near:
        return Verdict("unknown_effect", chosen)
    rivals = find_rivals(chosen, level)
    return Verdict("ambiguous" if rivals else "missing_effect", chosen, rivals)


def simplest(level: tuple[Explanation, ...]) -> Explanation:
    """The explanation with the fewest numbers among those that are as good as the best."""
    best = min(level, key=lambda e: e.judgement.costs.sum())
    equal = [e for e in level if not worse(e, best)]
    return min(equal, key=lambda e: (e.size, e.judgement.costs.sum()))


def find_rivals(chosen: Explanation, level: tuple[Explanation, ...]) -> tuple[Explanation, ...]:
    """Explanations by other effects, no richer than the chosen one, that are as good."""
    rivals: dict[frozenset[tuple[str, str]], Explanation] = {}
    for other in level:
        if named(other) != named(chosen) and other.size <= chosen.size and not worse(other, chosen):
            rivals.setdefault(named(other), other)
    return tuple(rivals.values())


def worse(other: Explanation, best: Explanation) -> bool:
    """Whether held-out trials speak against `other`: significantly, and by more than a few per cent."""
    margin = AS_GOOD if best.error <= FLOOR else AS_GOOD_ABOVE_FLOOR
    ratio = other.judgement.costs.sum() / best.judgement.costs.sum()
    return bool(ratio > margin and p_value(other.judgement, best.judgement) < SIGNIFICANT)


def named(explanation: Explanation) -> frozenset[tuple[str, str]]:
    """The (effect, joint) pairs of an explanation, whatever their form."""
    return frozenset((c.effect.name, joint) for c in explanation.effects for joint in c.joints)


def unexplained_joints(chosen: Explanation, joints: tuple[str, ...]) -> list[str]:
    """Joints whose held-out error stays above what is tolerated."""
    errors = chosen.judgement.joint_errors
    return [joint for joint, error in zip(joints, errors, strict=True) if error > TOLERATED]
