"""Simpler and richer laws of the same kind as one that is fitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.effects.scales import FINGER
from tactile_cube.identification.fitting.model import Model, Unknown
from tactile_cube.identification.search.candidates import Candidate, term_unknowns
from tactile_cube.identification.search.explanation import first_term


def with_details(candidate: Candidate, model: Model) -> tuple[Candidate, Model, tuple[Unknown, ...]] | None:
    """The last effect of a fitted model with the details of its law free too: as candidate, model and unknowns.

    None for a law that has none, or none that is not fitted already.

    Args:
        candidate: the last effect.
        model: fitted.
    """
    details = [name for name in candidate.effect.details if name not in candidate.form]
    if not details:
        return None
    neutral = {name: p.neutral for name, p in candidate.parameters(candidate.joints[0]).items() if name in details}
    first = len(model.terms) - len(candidate.joints)
    terms = [replace(term, fitted=(*term.fitted, *details)) for term in model.terms[first:]]
    unknowns = [u for k, term in enumerate(terms) for u in term_unknowns(term, first + k, candidate.sizes)]
    detailed = replace(candidate, form={**candidate.form, **neutral})
    return detailed, replace(model, terms=(*model.terms[:first], *terms)), tuple(unknowns)


def special_cases(
    model: Model, effects: Sequence[Candidate], place: int, known: Sequence[type[Effect]]
) -> Iterator[tuple[Candidate, Model]]:
    """Models with an effect's special cases in its place, at their starts, fewest numbers first.

    Args:
        model: fitted; its last terms are those of `effects`.
        effects: in the order in which they were added.
        place: of the effect.
        known: classes to try.
    """
    one, first = effects[place], first_term(model, effects, place)
    simpler = [effect for effect in known if effect.name in one.effect.contains]
    starts = [(effect, start) for effect in simpler for start in effect.forms_at(one.sizes.get(one.joints[0], FINGER))]
    for effect, start in sorted(starts, key=lambda pair: len(pair[1])):
        special = Candidate(effect, one.joints, start, one.sizes)
        if special.size < one.size and not set(effect.from_residual) & set(start):
            added, _ = special.added_to(replace(model, terms=model.terms[:first]))
            yield special, replace(model, terms=(*added.terms, *model.terms[first + len(one.joints) :]))
