"""From everything that was tried to an answer: adequate, missing_effect, ambiguous or unknown_effect."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from tactile_cube.identification.search.evidence import gain, p_value, worse
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.search import Findings
from tactile_cube.identification.search.simplicity import contains, named, simplest
from tactile_cube.identification.search.worth import SMALLEST_GAIN

Kind = Literal["adequate", "missing_effect", "ambiguous", "unknown_effect"]
TOLERATED = 1.6  # error / sensor noise up to which an explanation is complete
EXPLAINED, TOLERATED_IF_EXPLAINED = 0.98, 4.0  # share of the excess error, and the error, that a near miss may have
MOST = 0.9  # share of the excess error that has to be explained unless the error is as good as none
LIKELY = 0.05  # p-value at which a richer explanation stays in the race
ADEQUATE = 1.3  # error / sensor noise of a model to which nothing significant can be added


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


def decide(findings: Findings, as_repeats: bool = False) -> Verdict:
    """The answer to what a search has found.

    Args:
        findings: of the search.
        as_repeats: simulated freely, the recommended explanation is no further from the held-out trials than the
            machine is from itself in repeats. Where it can tip over, a few segments are far off all the same.
    """
    base = findings.base
    if not findings.levels:
        return Verdict("adequate" if base.error <= ADEQUATE else "unknown_effect", base)
    found = [one for level in findings.levels for one in level]
    chosen = simplest(found)
    if stretched(chosen):
        plausible = [one for one in found if not stretched(one) and not worse(one.judgement, chosen.judgement)]
        if not plausible:
            return Verdict("unknown_effect", chosen)
        chosen = simplest(plausible)
    near = chosen.explained(base) > EXPLAINED and (chosen.error < TOLERATED_IF_EXPLAINED or as_repeats)
    far = chosen.error > ADEQUATE and chosen.explained(base) < MOST
    if far or (chosen.error > TOLERATED and not near):
        return Verdict("unknown_effect", chosen)
    rivals = find_rivals(chosen, [one for one in found if not stretched(one)])
    return Verdict("ambiguous" if rivals else "missing_effect", chosen, rivals)


def stretched(one: Explanation) -> bool:
    """Whether a number of its effects ends at the edge of what such a number may be.

    Then the law stands in for another one: so do waves longer than the range of motion for any bent curve.
    """
    model = one.fit.model
    return any(
        math.isclose(unknown.of(model), edge, rel_tol=1e-6) and edge != unknown.neutral
        for unknown in one.fit.unknowns
        if unknown.kind == "effect" and unknown.place >= len(model.terms) - one.terms
        for edge in (unknown.low, unknown.high)
    )


def find_rivals(chosen: Explanation, found: Sequence[Explanation]) -> tuple[Explanation, ...]:
    """Explanations by as many other effects that are as good: with at most a number more, or else clearly better.

    Of laws that contain the chosen one only those that are clearly better: they always follow data as well.
    """
    rivals: dict[frozenset[tuple[str, str]], Explanation] = {}
    for other in sorted(found, key=lambda e: e.judgement.costs.sum()):
        if len(named(other)) > len(named(chosen)) or named(other) == named(chosen):
            continue
        simple = other.size <= chosen.size + 1 and not contains(other, chosen)
        if (simple or _richer_earned(other, chosen)) and not worse(other.judgement, chosen.judgement):
            rivals.setdefault(named(other), other)
    return tuple(rivals.values())


def _richer_earned(other: Explanation, chosen: Explanation) -> bool:
    """Whether more numbers than the chosen one has pay: a law that contains another always fits a little better."""
    better = gain(chosen.judgement, other.judgement) > SMALLEST_GAIN
    return better and p_value(chosen.judgement, other.judgement) < LIKELY


def unexplained_joints(chosen: Explanation, joints: tuple[str, ...]) -> list[str]:
    """Joints whose held-out error stays above what is tolerated."""
    errors = chosen.judgement.joint_errors
    return [joint for joint, error in zip(joints, errors, strict=True) if error > TOLERATED]
