"""A set of effects that may be what is missing: when it earns its place, and which of several is the simplest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.evidence import Judgement, at_joints, gain, worse


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


def needless(
    judged: Judgement,
    simpler: Judgement,
    joints: Sequence[str],
    removed: Sequence[Candidate],
    criteria: Criteria = STANDARD,
) -> bool:
    """Whether the held-out trials do without effects, as far as the joints where these act are concerned.

    A joint of many is a small part of a machine's error, whatever it needs itself.
    """
    places = sorted({joints.index(joint) for one in removed for joint in one.joints})
    return not worse(at_joints(simpler, places), at_joints(judged, places), criteria)


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


@dataclass(frozen=True)
class Proposal:
    """A set of effects and how it fits; no held-out trial has been asked.

    Attributes:
        effects: in the order in which they came.
        fit: of everything together.
    """

    effects: tuple[Candidate, ...]
    fit: Fit = field(repr=False)

    def price(self, criteria: Criteria) -> float:
        """Squared error, with as much for each number as an effect has to explain at least."""
        return float(self.fit.cost / (1.0 - criteria.least_gain) ** sum(one.size for one in self.effects))
