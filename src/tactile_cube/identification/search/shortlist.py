"""Which candidates come along: worth a refit after a first look, worth a full fit after a refit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.screening import Score

VARIANTS = 1  # further forms or places of these effects that come along
RESIZED = (0.2, 6.0)  # factors of the first look that are believed
UNDERRATED = 4.0  # times that a refit may explain more than the first look
AS_GOOD = 0.95  # share of the best first-order gain from which on a start of the same law looks as good
PROMISING = 0.03  # share of the best first-order gain that a candidate needs to be refitted


def with_groups(scores: Sequence[Score], needed: float) -> list[Candidate]:
    """Candidates worth a refit, best first; an effect that helps at several joints also stands for all of them.

    None where even the best of them is far from taking as much off the squared error as is `needed`.
    """
    starts: dict[tuple[str, tuple[str, ...], tuple[str, ...]], list[Score]] = {}
    for score in scores:
        key = (score.candidate.effect.name, tuple(score.candidate.form), score.candidate.joints)
        starts.setdefault(key, []).append(score)
    best = {key: start(same) for key, same in starts.items()}
    ranked = [(score.gain, resized(score)) for score in best.values() if score.gain > 0.0]
    families: dict[tuple[str, tuple[str, ...]], list[Score]] = {}
    for (name, form, _), score in best.items():
        families.setdefault((name, form), []).append(score)
    for members in families.values():
        useful = [m for m in members if m.gain > 0.0]
        if len(useful) > 1 and sum(m.gain for m in useful) > 1.3 * max(m.gain for m in useful):
            first = useful[0].candidate
            joints = tuple(m.candidate.joints[0] for m in useful)
            ranked.append((sum(m.gain for m in useful), replace(first, joints=joints)))
    ranked.sort(key=lambda pair: -pair[0])
    most = ranked[0][0] if ranked else 0.0
    if UNDERRATED * most < needed:
        return []
    return [candidate for gained, candidate in ranked if gained > PROMISING * most]


def start(same: Sequence[Score]) -> Score:
    """Of starts of one law, best first, the one that is nearest to its size among those that look as good as the best.

    What has to become six times as large, as a small mass where a large one is meant, is extrapolated too far.
    """
    return min(
        (score for score in same if score.gain >= AS_GOOD * same[0].gain),
        key=lambda score: abs(math.log(score.factor)) if score.factor > 0.0 else math.inf,
    )


def resized(score: Score) -> Candidate:
    """The candidate with its start as large as the first look says, where a single number makes the effect's size.

    Others may say where or how fast: they have no neutral value of zero.
    """
    (name, start), *more = score.candidate.form.items()
    parameters = score.candidate.parameters(score.candidate.joints[0])
    known, sizes = parameters[name], [n for n, _ in more if parameters[n].neutral == 0.0]
    if sizes or known.neutral != 0.0 or not RESIZED[0] < score.factor < RESIZED[1]:
        return score.candidate
    size = min(max(score.factor * start, known.low), known.high)
    return replace(score.candidate, form={**score.candidate.form, name: size})


def of_each(pairs: Sequence[tuple[Candidate, Fit]], count: int) -> list[tuple[Candidate, Fit]]:
    """The best of each of the `count` best effects, and `VARIANTS` more, still in their order.

    Forms and places of one effect that follow the data alike would else leave no room for another that does so too.
    """
    names = list(dict.fromkeys(candidate.effect.name for candidate, _ in pairs))[:count]
    first = [next(k for k, (candidate, _) in enumerate(pairs) if candidate.effect.name == name) for name in names]
    others = [k for k in range(len(pairs)) if k not in first][: VARIANTS + count - len(first)]
    return [pairs[k] for k in sorted([*first, *others])]
