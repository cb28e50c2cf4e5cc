"""Simpler and richer laws of the same kind as one that is fitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from tactile_cube.drivetrain.effects.scales import FINGER
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.identification.search.candidates import Candidate, term_unknowns
from tactile_cube.identification.search.explanation import first_term
from tactile_cube.measurement.replay.model import Model


def with_details(candidate: Candidate, model: Model) -> tuple[Candidate, Model, tuple[Unknown, ...]] | None:
    """The last effect of a fitted model with the details of its law free too: as candidate, model and unknowns.

    None for a law of which the recording can tell no details that are not fitted already.

    Args:
        candidate: the last effect.
        model: fitted.
    """
    first = len(model.terms) - len(candidate.joints)
    scales = candidate.sizes.get(candidate.joints[0], FINGER)
    told = candidate.effect.details_at(scales, model.terms[first].values)
    details = [name for name in told if name not in candidate.form]
    if not details:
        return None
    neutral = {name: p.neutral for name, p in candidate.parameters(candidate.joints[0]).items() if name in details}
    terms = [replace(term, fitted=(*term.fitted, *details)) for term in model.terms[first:]]
    unknowns = [u for k, term in enumerate(terms) for u in term_unknowns(term, first + k, candidate.sizes)]
    detailed = replace(candidate, form={**candidate.form, **neutral})
    return detailed, replace(model, terms=(*model.terms[:first], *terms)), tuple(unknowns)


def special_cases(
    model: Model, effects: Sequence[Candidate], place: int, known: Sequence[Candidate]
) -> Iterator[tuple[tuple[Candidate, ...], Model]]:
    """Sets, and their models, with a special case of an effect's law in its place, at its start.

    Args:
        model: fitted; its last terms are those of `effects`.
        effects: in the order in which they were added.
        place: of the effect.
        known: candidates to try.
    """
    one, first = effects[place], first_term(model, effects, place)
    for special in known:
        contained = special.effect.name in one.effect.contains
        contained |= special.effect == one.effect and special.form.keys() < one.form.keys()
        if contained and special.joints == one.joints and special.size < one.size:
            added, _ = special.added_to(replace(model, terms=model.terms[:first]))
            rest = model.terms[first + len(one.joints) :]
            yield (*effects[:place], special, *effects[place + 1 :]), replace(model, terms=(*added.terms, *rest))
