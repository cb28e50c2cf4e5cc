"""Other values from which a fit may reach a deeper valley."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.measurement.replay.model import Model

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
