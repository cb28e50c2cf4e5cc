"""Everything that a search finds: one effect after another, sets of effects at once, and what would do as well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tactile_cube.identification.search.candidates import without_effect
from tactile_cube.identification.search.evidence import Judgement, worse
from tactile_cube.identification.search.explanation import Explanation, named, named_by, simplest
from tactile_cube.identification.search.screening import Score, screen, with_groups
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.search.shared_offset import shared_offset
from tactile_cube.identification.search.together import Together, standard_explanations


@dataclass(frozen=True)
class Findings:
    """Everything that a search has tried.

    Attributes:
        base: the refitted base model.
        nominal: the model before any fit, judged on the held-out trials.
        levels: explanations with 1, 2, ... effects, best first; or the sets that were found together alone.
        scores: screening of the first level, best first.
        unproven: where the search ended, what would explain much and may be chance, best first.
        surpassed: what was found one by one and is clearly worse than the sets that were found together.
        unclear: sets that were found together and are not clearly better: to predict with where none is claimed.
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
    base, criteria = search.base, search.criteria
    search.say(f"base refitted: held-out error {base.error:.2f} x sensor noise")
    nominal = search.judged(search.start)
    standard = standard_explanations(search, base) if base.error > criteria.far else ()
    levels, scores, doubtful = search.one_by_one(base, standard)
    found = [e for level in levels for e in level]
    best = min(found, key=lambda e: e.error, default=base)
    surpassed: list[Explanation] = []
    unclear: tuple[Explanation, ...] = ()
    whole = standard and standard[0].explained(base) > criteria.most
    if search.sets and not whole and best.error > criteria.far and not search.hidden_by_steps(best):
        sets, unclear = Together(search, base, search.fold_divisions()).run(search.leaders, best)
        levels, surpassed, doubtful = ([sets], found, []) if sets else (levels, surpassed, doubtful)
    while found := [e for level in levels for e in level]:
        chosen = simplest(found, criteria)
        if chosen.explained(base) <= criteria.most or not (others := twins(search, chosen, base, found)):
            break
        levels[-1] = (*levels[-1], *others)
        if len(named(simplest([*found, *others], criteria))) >= len(named(chosen)):
            break  # else fewer do as well, which may have others in their place too
    if not levels and base.largest_error <= criteria.floor:
        shared = shared_offset(base, search.fitted, search.effects, search.shooting.sizes)
        levels = [(shared,)] if shared else []
    unproven = tuple(sorted(doubtful, key=lambda e: e.error))
    return Findings(base, nominal, tuple(levels), scores, unproven, tuple(surpassed), unclear)


def among(search: Search, known: Sequence[Explanation]) -> Findings:
    """Judge explanations that are known, and look for no others."""
    base = search.base
    search.say(f"base refitted: held-out error {base.error:.2f} x sensor noise")
    refitted = [search.explanation(base, one.effects, one.fit.model, len(known)) for one in known]
    return Findings(base, search.judged(search.start), (tuple(search.pruned(one) for one in refitted),), ())


REFITTED = 10  # laws in the place of one effect, most promising first
AS_CLOSE = 2.5  # squared error over the chosen one's at which another law is worth a fit of everything
LEFT = 0.05  # share of what the effect explains that a brief refit of another law may leave


def twins(search: Search, chosen: Explanation, base: Explanation, found: Sequence[Explanation]) -> list[Explanation]:
    """Return explanations as good, with another law in the place of one of the chosen ones, of those not known as good.

    The other effects and all constants are free. Without this, what is named hangs on the order in which effects were
    added: the second of two laws that do the same finds nothing left to explain. A law that contains the chosen one
    always does as well, and is none of them.

    Args:
        search: the recording and its effects.
        chosen: the answer that is to be given.
        base: the refitted base model.
        found: what has been tried.
    """
    known = {named_by(one.effects) for one in found if not worse(one.judgement, chosen.judgement, search.criteria)}
    search.say(f"what else would explain as much as {chosen.label}?")
    reached = search.frozen(chosen.fit).cost
    others = []
    for place, effect in enumerate(chosen.effects):
        parent = without(search, chosen, place) if len(chosen.effects) > 1 else base
        frozen = search.frozen(parent.fit)
        wanted = [
            one
            for one in search.new(search.candidates)
            if one.joints[0] in effect.joints
            and named_by((*parent.effects, one)) not in known
            and effect.effect.name not in one.effect.contains
        ]
        promising = with_groups(screen(search.problem, frozen, wanted), 0.0)[:REFITTED]
        brief = search.brief(frozen, promising)
        close = max(AS_CLOSE * reached, reached + LEFT * (frozen.cost - reached))
        near = [(candidate, fit) for candidate, fit in brief if fit.cost <= close]
        longer = [(candidate, search.continued(frozen, fit)) for candidate, fit in near]
        as_close = [pair for pair in longer if pair[1].cost <= AS_CLOSE * chosen.fit.cost]
        finished = [search.finish(parent, *one, len(as_close)) for one in as_close]
        others += [one for one in finished if not worse(one.judgement, chosen.judgement, search.criteria)]
    return [search.pruned(one) for one in others]


def without(search: Search, chosen: Explanation, place: int) -> Explanation:
    """Return an explanation without one of its effects, refitted."""
    fitted, judgement = search.settled(without_effect(chosen.fit.model, chosen.effects, place))
    left = (*chosen.effects[:place], *chosen.effects[place + 1 :])
    return Explanation(left, fitted, judgement, 1.0, 0.0)
