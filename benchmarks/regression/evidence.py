"""Held-out statistics of every set that a search judged, kept so that other criteria may be tried on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.criteria import Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.evidence import Judgement, gain, p_value
from tactile_cube.identification.search.explanation import Explanation, named_by
from tactile_cube.identification.search.findings import Findings
from tactile_cube.identification.verdict import decide
from tactile_cube.measurement.replay.model import Model, Term

DIGITS = 6
NOTHING = np.zeros((0, 0))


def stored(findings: Findings) -> dict[str, Any]:
    """The statistics by which a verdict is decided, as plain numbers."""
    base = findings.base.judgement
    return {
        "looked": findings.looked,
        "samples": base.samples.tolist(),
        "trial": base.trial.tolist(),
        "base": _judged(base),
        "sets": [
            _judged(one.judgement)
            | {"p_value": one.p_value, "gain": one.gain, "shared": one.judgement is base, "effects": _effects(one)}
            for one in findings.judged
        ],
    }


def decided(table: Mapping[str, Any], criteria: Criteria, strength: float = 1.0) -> tuple[str, list[list[str]], float]:
    """The verdict's kind by these statistics, the effects of the chosen set and its rivals, and the base model's error.

    Had what is hidden been of another `strength`, all that is more than noise would be as many times as large squared.
    """
    found = _findings(table, strength)
    verdict = decide(found, criteria)
    sets = (verdict.chosen, *verdict.rivals) if verdict.kind not in ("adequate", "unknown_effect") else ()
    named_in = [sorted(f"{name}@{joint}" for name, joint in named_by(one.effects)) for one in sets]
    return verdict.kind, named_in, found.base.largest_error


def _judged(one: Judgement) -> dict[str, Any]:
    costs = [float(f"{cost:.{DIGITS}g}") for cost in one.costs]
    return {"costs": costs, "joint_errors": one.joint_errors.round(DIGITS).tolist()}


def _effects(one: Explanation) -> list[dict[str, Any]]:
    """Each effect with the numbers that were fitted: values, and the edges of what they may be."""
    first = len(one.fit.model.terms) - one.terms
    found: list[dict[str, Any]] = []
    for candidate in one.effects:
        terms = range(first, first + len(candidate.joints))
        numbers = [
            {"key": u.key, "place": u.place - first, "low": u.low, "high": u.high, "neutral": u.neutral}
            | {"value": u.of(one.fit.model)}
            for u in one.fit.unknowns
            if u.kind == "effect" and u.place in terms
        ]
        entry = {"name": candidate.effect.name, "joints": candidate.joints, "form": [*candidate.form]}
        found.append(entry | {"numbers": numbers})
        first += len(candidate.joints)
    return found


def _findings(table: Mapping[str, Any], strength: float) -> Findings:
    base = _explanation(table, table["base"] | {"effects": [], "p_value": 1.0, "gain": 0.0}, strength)
    sets = []
    for entry in table["sets"]:
        one = _explanation(table, entry, strength)
        if entry["shared"]:
            one = replace(one, judgement=base.judgement)
        elif strength != 1.0:
            chance = min(1.0, p_value(base.judgement, one.judgement) * table["looked"])
            one = replace(one, p_value=chance, gain=gain(base.judgement, one.judgement))
        sets.append(one)
    return Findings(base, base.judgement, tuple(sets), looked=table["looked"])


def _explanation(table: Mapping[str, Any], one: Mapping[str, Any], strength: float) -> Explanation:
    terms: list[Term] = []
    unknowns: list[Unknown] = []
    candidates = []
    for entry in one["effects"]:
        effect, first = find_effect(entry["name"]), len(terms)
        for place, joint in enumerate(entry["joints"]):
            numbers = [u for u in entry["numbers"] if u["place"] == place]
            values = {u["key"]: u["value"] for u in numbers}
            terms.append(Term(effect, joint, values, tuple(values)))
            unknowns += [
                Unknown("effect", u["key"], first + place, u["low"], u["high"], 1.0, neutral=u["neutral"])
                for u in numbers
            ]
        candidates.append(Candidate(effect, tuple(entry["joints"]), dict.fromkeys(entry["form"], 0.0)))
    model = Model({}, tuple(terms), {})
    samples, errors = np.array(table["samples"]), np.array(one["joint_errors"])
    costs = np.array(one["costs"])
    costs = costs + (strength**2 - 1.0) * np.maximum(costs - samples, 0.0)
    errors = np.sqrt(errors**2 + (strength**2 - 1.0) * np.maximum(errors**2 - 1.0, 0.0))
    judgement = Judgement(model, costs, samples, NOTHING, errors, np.array(table["trial"]))
    fit = Fit(model, tuple(unknowns), float(costs.sum()), 0.0, NOTHING, NOTHING, NOTHING)
    return Explanation(tuple(candidates), fit, judgement, one["p_value"], one["gain"])
