"""When an effect earns its place in an explanation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.search.explanation import Explanation


def worthwhile(
    explanation: Explanation,
    parent: Explanation,
    base: Explanation,
    joints: Sequence[str],
    criteria: Criteria = STANDARD,
) -> bool:
    """Whether an effect earns its place.

    Significantly, and by more than a few per cent; a further effect has to complete the explanation, or that of the
    joints where it acts, or to do most of what is left while that is a real part of the whole, or nearly all of it,
    where that leaves nothing or was too much for a detail of the effect before.
    What is next to nothing beside the whole is a detail too, where there is little left anyway.
    """
    if explanation.gain < criteria.least_gain or not proven(explanation, parent, criteria):
        return False
    if not parent.effects:
        return True
    if (
        parent.error < criteria.adequate
        and parent.error**2 - explanation.error**2 < criteria.small_part * base.error**2
    ):
        return False
    if explanation.largest_error <= criteria.floor or completes_its_joints(explanation, parent, joints, criteria):
        return True
    share = explanation.explained(parent)
    if parent.explained(base) < criteria.nearly_whole:
        return share > criteria.completing
    return share > criteria.most and (parent.error > criteria.far or explanation.error <= criteria.adequate)


def proven(explanation: Explanation, parent: Explanation, criteria: Criteria = STANDARD) -> bool:
    """Whether held-out segments tell what the last effect explains from chance; the more it is, the less it takes."""
    enough = criteria.significant
    if explanation.gain > criteria.large_gain:
        enough = criteria.significant_if_large
    if explanation.gain > criteria.most_gain:
        enough = criteria.significant_if_most
    if explanation.largest_error <= criteria.floor and not parent.effects:
        enough = criteria.significant_if_most
    return explanation.p_value <= enough


def unproven(explanation: Explanation, parent: Explanation, criteria: Criteria = STANDARD) -> bool:
    """Whether an effect explains much, and there are too few held-out segments to tell that from chance."""
    few = np.count_nonzero(explanation.judgement.samples) < criteria.few_segments
    return bool(few and explanation.gain > criteria.large_gain and not proven(explanation, parent, criteria))


def least_gain(parent: Explanation, base: Explanation, criteria: Criteria = STANDARD) -> float:
    """Share of the squared error that a further effect has to explain at least to earn its place."""
    if not parent.effects or parent.explained(base) < criteria.nearly_whole or parent.error > criteria.far:
        return criteria.least_gain
    squares = parent.judgement.joint_errors**2
    poor = squares[squares > criteria.adequate**2]
    nearly_all = max(1.0 - (criteria.adequate / parent.error) ** 2, criteria.most * (1.0 - parent.error**-2))
    completing = [1.0 - (criteria.floor / parent.error) ** 2, nearly_all, *(poor - criteria.floor**2) / squares.sum()]
    return max(criteria.least_gain, float(min(completing)))


def completes_its_joints(
    explanation: Explanation, parent: Explanation, joints: Sequence[str], criteria: Criteria = STANDARD
) -> bool:
    """Whether the last effect takes the error of the joints where it acts down to the floor."""
    places = [joints.index(joint) for joint in explanation.effects[-1].joints]
    before, after = (one.judgement.joint_errors[places] for one in (parent, explanation))
    return bool(before.max() > criteria.adequate and after.max() <= criteria.floor)
