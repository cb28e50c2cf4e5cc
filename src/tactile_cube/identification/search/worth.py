"""When an effect earns its place in an explanation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactile_cube.identification.search.explanation import FLOOR, Explanation

FAR_FROM_FLOOR = 4.0  # error / sensor noise of an explanation that is none by itself
NEARLY_ALL = 0.9  # share of what it leaves that a further effect then has to explain
SMALLEST_GAIN = 0.04  # share of the held-out squared error that an effect has to explain
SIGNIFICANT = 2e-4  # p-value, corrected for the number of effects that were judged on the held-out trials
LARGE_GAIN, SIGNIFICANT_IF_LARGE = 0.25, 1e-3  # the same for a share that no chance explains: short recordings
MOST_OF_IT, SIGNIFICANT_IF_MOST = 0.75, 1e-2  # and for a share that needs hardly any proof
FEW_SEGMENTS = 60  # held-out segments, 24 s
SIGNIFICANT_IF_ALL = 0.01  # the same for one effect that explains everything
REAL_PART = 0.98  # share of the excess error up to which an explanation is far from complete
SMALL_PART, LITTLE = 0.001, 1.3  # share of the base error that is a detail, and the error from which on it may be
COMPLETED = 0.6  # share of the remaining excess error that a further effect has to explain, unless it reaches the floor


def worthwhile(explanation: Explanation, parent: Explanation, base: Explanation, joints: Sequence[str]) -> bool:
    """Whether an effect earns its place.

    Significantly, and by more than a few per cent; a further effect has to complete the explanation, or that of the
    joints where it acts, or to do most of what is left while that is a real part of the whole, or so much that it
    cannot be a detail of the effect before.
    What is next to nothing beside the whole is a detail too, where there is little left anyway.
    """
    if explanation.gain < SMALLEST_GAIN or not proven(explanation, parent):
        return False
    if not parent.effects:
        return True
    if parent.error < LITTLE and parent.error**2 - explanation.error**2 < SMALL_PART * base.error**2:
        return False
    if explanation.error <= FLOOR or completes_its_joints(explanation, parent, joints):
        return True
    share = explanation.explained(parent)
    if parent.explained(base) < REAL_PART:
        return share > COMPLETED
    return parent.error > FAR_FROM_FLOOR and share > NEARLY_ALL


def proven(explanation: Explanation, parent: Explanation) -> bool:
    """Whether held-out segments tell what the last effect explains from chance; the more it is, the less it takes."""
    enough = SIGNIFICANT
    if explanation.gain > LARGE_GAIN:
        enough = SIGNIFICANT_IF_LARGE
    if explanation.gain > MOST_OF_IT:
        enough = SIGNIFICANT_IF_MOST
    if explanation.complete and not parent.effects:
        enough = SIGNIFICANT_IF_ALL
    return explanation.p_value <= enough


def unproven(explanation: Explanation, parent: Explanation) -> bool:
    """Whether an effect explains much, and there are too few held-out segments to tell that from chance."""
    few = np.count_nonzero(explanation.judgement.samples) < FEW_SEGMENTS
    return bool(few and explanation.gain > LARGE_GAIN and not proven(explanation, parent))


def least_gain(parent: Explanation, base: Explanation) -> float:
    """Share of the squared error that a further effect has to explain at least to earn its place."""
    if not parent.effects or parent.explained(base) < REAL_PART or parent.error > FAR_FROM_FLOOR:
        return SMALLEST_GAIN
    squares = parent.judgement.joint_errors**2
    poor = squares[squares > LITTLE**2]
    completing = [1.0 - (FLOOR / parent.error) ** 2, *(poor - FLOOR**2) / squares.sum()]
    return max(SMALLEST_GAIN, float(min(completing)))


def completes_its_joints(explanation: Explanation, parent: Explanation, joints: Sequence[str]) -> bool:
    """Whether the last effect takes the error of the joints where it acts down to the floor."""
    places = [joints.index(joint) for joint in explanation.effects[-1].joints]
    before, after = (one.judgement.joint_errors[places] for one in (parent, explanation))
    return bool(before.max() > LITTLE and after.max() <= FLOOR)
