"""What else would explain what a chosen effect explains: asked of every effect of an answer, before it is given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tactile_cube.identification.search.evidence import worse
from tactile_cube.identification.search.explanation import Explanation, without_effect
from tactile_cube.identification.search.screening import screen
from tactile_cube.identification.search.shortlist import with_groups
from tactile_cube.identification.search.simplicity import named_by

if TYPE_CHECKING:
    from tactile_cube.identification.search.search import Search

REFITTED = 10  # laws in the place of one effect, most promising first
AS_CLOSE = 2.5  # squared error over the chosen one's at which another law is worth a fit of everything
LEFT = 0.05  # share of what the effect explains that a brief refit of another law may leave


def twins(search: Search, chosen: Explanation, base: Explanation, found: Sequence[Explanation]) -> list[Explanation]:
    """Return explanations as good, with another law in the place of one of the chosen ones, of those not tried before.

    The other effects and all constants are free. Without this, what is named hangs on the order in which effects were
    added: the second of two laws that do the same finds nothing left to explain. A law that contains the chosen one
    always does as well, and is none of them.

    Args:
        search: the recording and its effects.
        chosen: the answer that is to be given.
        base: the refitted base model.
        found: what has been tried.
    """
    known = {named_by(one.effects) for one in found}
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
