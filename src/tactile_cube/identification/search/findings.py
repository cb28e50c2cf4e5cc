"""The search: every law by itself, sets that grow while a joint is off, few sets judged once on held-out trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tactile_cube.identification.criteria import Criteria
from tactile_cube.identification.search.evidence import Judgement, worse
from tactile_cube.identification.search.explanation import (
    Explanation,
    Proposal,
    named_by,
    proven,
    simplest,
    unproven,
)
from tactile_cube.identification.search.proposals import (
    CLOSE,
    Looks,
    detailed,
    explains_most,
    further,
    grown,
    look,
    near,
    off,
    refitted,
    without,
)
from tactile_cube.identification.search.screening import Score
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.search.shared_offset import shared_offset

MOST = 4  # effects in a set
JUDGED = 6  # sets that the held-out trials judge, and as many more of what may stand for one of the chosen effects


@dataclass(frozen=True)
class Findings:
    """Everything that a search has tried.

    Attributes:
        base: the refitted base model.
        nominal: the model before any fit, judged on the held-out trials.
        levels: explanations that earn their place by number of effects, best first.
        scores: the first look at every law, best first.
        unproven: what would explain much and may be chance, best first.
        surpassed: what was judged and is clearly worse than the best.
        unclear: what was judged and does not earn its place: to predict with where nothing is claimed.
    """

    base: Explanation
    nominal: Judgement
    levels: tuple[tuple[Explanation, ...], ...]
    scores: tuple[Score, ...]
    unproven: tuple[Explanation, ...] = ()
    surpassed: tuple[Explanation, ...] = ()
    unclear: tuple[Explanation, ...] = ()


def find(search: Search) -> Findings:
    """Search a recording for what its model lacks."""
    base, nominal = search.base, search.judged(search.start)
    search.say(f"base refitted: held-out error {base.error:.2f} x sensor noise")
    if base.largest_error <= search.criteria.floor:
        shared = shared_offset(base, search.fitted, search.effects, search.shooting.sizes)
        return Findings(base, nominal, ((shared,),) if shared else (), ())
    way, first = proposed(search)
    looked = max(len(first.scores), 1) if first else 1
    judged = [search.explained(one, looked) for one in cheapest(way, search)[:JUDGED]]
    good = [one for one in judged if proven(one, search.criteria)]
    if good and first:
        chosen = simplest(good, search.criteria)
        others = [search.explained(one, looked) for one in twins(search, chosen, first, judged)]
        judged = [*judged, *others]
        good = [one for one in judged if proven(one, search.criteria)]
    return arranged(base, nominal, judged, good, first.scores if first else [], search.criteria)


def arranged(
    base: Explanation,
    nominal: Judgement,
    judged: Sequence[Explanation],
    good: Sequence[Explanation],
    scores: Sequence[Score],
    criteria: Criteria,
) -> Findings:
    """What was judged, by what came of it."""
    ordered = sorted(good, key=lambda one: one.judgement.costs.sum())
    kept = [one for one in ordered if not worse(one.judgement, ordered[0].judgement, criteria)]
    sizes = sorted({len(one.effects) for one in kept})
    levels = tuple(tuple(one for one in kept if len(one.effects) == size) for size in sizes)
    unclear = tuple(one for one in judged if one not in good)
    doubtful = tuple(sorted((e for e in unclear if unproven(e, criteria)), key=lambda e: e.error))
    surpassed = tuple(one for one in ordered if one not in kept)
    return Findings(base, nominal, levels, tuple(scores), doubtful if not kept else (), surpassed, unclear)


def proposed(search: Search) -> tuple[list[Proposal], Looks | None]:
    """Sets by their fit alone, and the first look."""
    parent = Proposal((), search.base.fit)
    found: list[Proposal] = []
    first: Looks | None = None
    while places := off(search.problem, parent.fit, search.criteria.floor):
        looks = look(search, parent, [search.fitted.joints[j] for j in places])
        first = first or looks
        if not looks.tried:
            break
        search.say(f"{len(looks.scores)} starts of {len(looks.tried)} laws beside {parent_label(parent)}")
        tried = [one for one in grown(search, looks) if len(one.effects) <= MOST]
        tried += [richer for richer in (detailed(search, one) for one in tried[:1]) if richer]
        tried.sort(key=lambda one: one.price(search.criteria))
        found += tried
        if not tried or tried[0].price(search.criteria) >= parent.price(search.criteria):
            break
        parent = tried[0]
        search.say(f"best so far: {parent_label(parent)} leaves {search.over_noise(parent.fit):.2f} x sensor noise")
        if len(parent.effects) >= MOST:
            break
    return [*found, *reduced(search, parent)], first


def reduced(search: Search, one: Proposal) -> list[Proposal]:
    """Sets that are left when one effect after another is taken out, the one that is missed least."""
    found: list[Proposal] = []
    while len(one.effects) > 1:
        less = [without(search, one, place) for place in range(len(one.effects))]
        found += less
        one = min(less, key=lambda e: e.fit.cost)
    return found


def cheapest(found: Sequence[Proposal], search: Search) -> list[Proposal]:
    """The cheapest of those that name the same effects, cheapest first."""
    first: dict[frozenset[tuple[str, str]], Proposal] = {}
    for one in sorted(found, key=lambda one: one.price(search.criteria)):
        first.setdefault(named_by(one.effects), one)
    return list(first.values())


def twins(search: Search, chosen: Explanation, first: Looks, judged: Sequence[Explanation]) -> list[Proposal]:
    """Sets with another law in the place of one of the chosen ones that fit as well with everything free.

    The laws that a chosen one becomes at the edge of its numbers come first; what has many more numbers is no twin.
    """
    known = {named_by(one.effects) for one in judged}
    itself, found = Proposal(chosen.effects, chosen.fit), list[Proposal]()
    for place, effect in enumerate(chosen.effects):
        looks = first
        if len(chosen.effects) > 1:
            looks = look(search, without(search, itself, place), list(effect.joints))
        laws = [one for one in looks.tried if one[0].size <= effect.size + 1 and explains_most(search, looks, one[1])]
        laws.sort(key=lambda one: one[0].effect.name not in effect.effect.contains)
        for candidate, fitted in laws[: 2 * JUDGED]:
            names = named_by((*looks.parent.effects, candidate))
            if len(found) >= JUDGED or names in known:
                continue
            known.add(names)
            if not near(search, looks, fitted, [itself]):
                fitted = further(looks, fitted)
            if near(search, looks, fitted, [itself]):
                found.append(refitted(search, looks, [(candidate, fitted)]))
    return [one for one in found if one.fit.cost <= CLOSE * chosen.fit.cost]


def parent_label(one: Proposal) -> str:
    """In words."""
    return " & ".join(c.label for c in one.effects) or "the refitted model"
