"""Simpler and richer laws of the same kind as one that is fitted, and other values from which to fit it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

from tactile_cube.drivetrain.effects.scales import FINGER
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.identification.search.candidates import Candidate, term_unknowns
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


FACTORS = {1: (0.35, 0.5, 0.7, 1.4, 2.0, 3.0), 2: (0.5, 0.7, 1.0, 1.4, 2.0), 3: (0.6, 1.0, 1.6)}
"""Of each number, by how many numbers there are."""


def other_starts(candidate: Candidate, model: Model) -> list[Model]:
    """Models whose last effect has its numbers multiplied, each by several factors, in all combinations.

    Empty for effects of more than three numbers, and for a ripple, whose harmonic is a whole number.

    Args:
        candidate: the last effect of the model, at all its joints.
        model: fitted.
    """
    names = tuple(candidate.form)
    if len(names) not in FACTORS or "harmonic" in names:
        return []
    first = len(model.terms) - len(candidate.joints)
    models = []
    for factors in product(FACTORS[len(names)], repeat=len(names)):
        if set(factors) == {1.0}:
            continue
        terms = list(model.terms)
        for place in range(first, len(terms)):
            old, known = terms[place].values, candidate.parameters(terms[place].joint)
            new = {n: min(max(f * old[n], known[n].low), known[n].high) for n, f in zip(names, factors, strict=True)}
            terms[place] = replace(terms[place], values={**old, **new})
        models.append(replace(model, terms=tuple(terms)))
    return models


def first_term(model: Model, effects: Sequence[Candidate], place: int) -> int:
    """Which of a model's terms, the last of which are those of `effects`, is the first one of an effect."""
    known = len(model.terms) - sum(len(candidate.joints) for candidate in effects)
    return known + sum(len(candidate.joints) for candidate in effects[:place])


def without_effect(model: Model, effects: Sequence[Candidate], place: int) -> Model:
    """A fitted model, whose last terms are those of `effects`, without one of them."""
    first = first_term(model, effects, place)
    return replace(model, terms=(*model.terms[:first], *model.terms[first + len(effects[place].joints) :]))


def fewer_joints(
    model: Model, effects: Sequence[Candidate], place: int
) -> Iterator[tuple[tuple[Candidate, ...], Model]]:
    """Where one of `effects` acts at several joints: the effects and the fitted model without it at one of them."""
    candidate, first = effects[place], first_term(model, effects, place)
    for k, joint in enumerate(candidate.joints if len(candidate.joints) > 1 else ()):
        left = replace(candidate, joints=tuple(other for other in candidate.joints if other != joint))
        terms = (*model.terms[: first + k], *model.terms[first + k + 1 :])
        yield (*effects[:place], left, *effects[place + 1 :]), replace(model, terms=terms)


def with_effects(model: Model, candidates: Sequence[Candidate]) -> Model:
    """The model with all of them at their starts."""
    for candidate in candidates:
        model, _ = candidate.added_to(model)
    return model
