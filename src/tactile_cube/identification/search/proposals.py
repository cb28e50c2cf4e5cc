"""Candidate sets of effects, ranked on the fitted trials: single laws, pairs, and one law at several joints."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Stage
from tactile_cube.identification.criteria import Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit, fit, noise_inflation, precision
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.unknowns import put_all, read_all
from tactile_cube.identification.search.candidates import (
    Candidate,
    Score,
    resized,
    screen,
    start,
    with_details,
    without_effect,
)
from tactile_cube.identification.search.evidence import joint_errors, joint_squares
from tactile_cube.identification.search.explanation import Proposal, at_bound, named_by, priced
from tactile_cube.identification.search.residual_starts import residual_candidates
from tactile_cube.identification.search.search import Search, failing
from tactile_cube.measurement.replay.model import Model, Term
from tactile_cube.measurement.replay.windows import Windows

LOOKED_AT = 4  # part of the segments to judge by, on which every law gets its own steps
PROMISING = 0.01  # of its joint's squared error: least first-order gain of a law that is fitted
STEPS = 2  # of Gauss-Newton for each promising law
MORE_STEPS = 6  # for a law that is asked for, or that may be an alternative to a chosen one
LARGER = 2.0  # most that a law is scaled up within a set; its linearisation holds near its own fit
SINGLES = 4  # laws that are refitted exactly
LEAVE_LEAST, CHEAPEST = 3, 2  # pairs that are refitted: with the smallest predicted error, with the lowest price
SHARES = (1.0, 0.25, 0.06)  # of the way to where laws' own steps led, at which a set may begin
CLOSE = 2.5  # ratio of squared errors up to which a full refit may make another law as good as the best


Tried = tuple[tuple[Candidate, Fit], ...]  # laws that are added together, each after its own steps


@dataclass(frozen=True)
class Looks:
    """Screening of all laws beside a fitted set.

    Attributes:
        parent: the fitted set.
        problem: the windows used, fewer than in a full fit.
        frozen: fit of the set on these windows.
        alike: the same after as many steps as each law gets, as the reference of their gains.
        tried: promising laws with their fits, best first.
        scores: first-order gain of every law, best first.
    """

    parent: Proposal
    problem: Problem = field(repr=False)
    frozen: Fit = field(repr=False)
    alike: Fit = field(repr=False)
    tried: list[tuple[Candidate, Fit]] = field(repr=False)
    scores: list[Score] = field(repr=False)

    @property
    def laws(self) -> int:
        """Number of laws screened, each counted once whatever its starts."""
        return len({key(score.candidate) for score in self.scores})


def off(search: Search, one: Fit) -> list[int]:
    """Return the joints whose error on the fitted trials exceeds the noise floor."""
    return [int(j) for j in np.flatnonzero(joint_errors(search.problem, one.residual) > search.criteria.floor)]


def look(search: Search, parent: Proposal, at: Sequence[str]) -> Looks:
    """Screen all laws at some joints beside a fitted set, and fit the promising ones."""
    problem = Problem(search.shooting, failing_windows(search, parent.fit))
    problem.linearise_starts(parent.fit.model)
    frozen = fit(problem, parent.fit.model, parent.fit.unknowns, iterations=0)
    there = named_by(parent.effects)
    possible = [
        one
        for one in wanted(search, problem, frozen)
        if there.isdisjoint(named_by([one])) and (one.joints[0] in at or one.effect.stage is Stage.MECHANISM)
    ]
    scores = screen(problem, frozen, possible)
    of_joints = np.maximum(joint_squares(problem, frozen.residual)[0].sum(axis=0), 0.0)
    squares = dict(zip(search.fitted.joints, of_joints, strict=True))
    promising = [one for one in scores if one.gain > PROMISING * min(squares[joint] for joint in one.candidate.joints)]
    tried = sorted((stepped(problem, frozen, one) for one in best_starts(promising)), key=lambda pair: pair[1].cost)
    alike = fit(problem, frozen.model, (), STEPS, frozen)
    return Looks(parent, problem, frozen, alike, tried, scores)


def failing_windows(search: Search, fitted: Fit) -> Windows:
    """Return few of the fitted windows: half of them with the largest error, half spread over all.

    A law that acts rarely, as a limit does, is visible only where the set fails.
    """
    windows = search.problem.windows
    return failing(windows, search.problem.cost(fitted.residual), search.segments // LOOKED_AT)


def wanted(search: Search, problem: Problem, frozen: Fit) -> list[Candidate]:
    """Return candidate effects, with starts of their own or estimated from the residual."""
    return search.new([*search.candidates, *residual_candidates(problem, search.fitted, frozen, search.effects)])


def stepped(problem: Problem, frozen: Fit, candidate: Candidate, iterations: int = STEPS) -> tuple[Candidate, Fit]:
    """Fit a law alone beside a frozen fit."""
    model, unknowns = candidate.added_to(frozen.model)
    return candidate, fit(problem, model, unknowns, iterations, frozen)


def best_starts(scores: Sequence[Score]) -> list[Candidate]:
    """Return the start with the largest first-order gain of each law, form and joint, scaled to its optimum."""
    starts: dict[tuple[str, tuple[str, ...], tuple[str, ...]], list[Score]] = {}
    for score in scores:
        starts.setdefault(key(score.candidate), []).append(score)
    return [resized(start(same)) for same in starts.values()]


def key(candidate: Candidate) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """Return the key of a law in a form at its joints."""
    return candidate.effect.name, tuple(candidate.form), candidate.joints


def grown(search: Search, looks: Looks) -> list[Proposal]:
    """Return refitted sets that extend the parent, cheapest first.

    Once a set is at the noise floor, only laws whose own fit came close to it are refitted too, and simpler ones: a
    table follows the fitted trials whatever is behind them.
    """
    by_name: dict[tuple[str, tuple[str, ...]], Tried] = {}
    for candidate, fitted in looks.tried:
        name = candidate.effect.name, candidate.joints
        by_name[name] = (*by_name.get(name, ()), (candidate, fitted))
    found: list[Proposal] = []
    for forms in list(by_name.values())[:SINGLES]:
        as_simple = [one for one in found if one.effects[-1].size <= forms[0][0].size]
        if not whole(search, as_simple) or near(looks, forms[0][1].cost, found):
            found += in_its_forms(search, looks, forms)
    if not whole(search, found):
        found += [refitted(search, looks, laws) for laws in sets(looks, search.criteria) if not search.spent]
    return sorted(found, key=lambda one: one.price(search.criteria))


def in_its_forms(search: Search, looks: Looks, forms: Tried) -> list[Proposal]:
    """Refit a law in its best form, plain and detailed, and in the next form if a parameter is at a bound."""
    found: list[Proposal] = []
    for law in forms:
        if not search.spent and all(at_bound(one) for one in found):
            one = refitted(search, looks, (law,))
            found += [one, *(richer for richer in [detailed(search, one)] if richer)]
    return found


def whole(search: Search, found: Sequence[Proposal]) -> bool:
    """Return whether one of the sets is at the noise floor at every joint."""
    return any(not off(search, one.fit) for one in found)


def near(looks: Looks, left: float, found: Sequence[Proposal]) -> bool:
    """Return whether the error of laws after their own steps is close to that of the best set on the same windows."""
    return bool(left <= CLOSE * min(fit(looks.problem, one.fit.model, (), 0).cost for one in found))


def explains_most(search: Search, looks: Looks, left: float) -> bool:
    """Return whether laws explain most of the excess error of the set by their own steps."""
    count = np.count_nonzero(looks.problem.weight)
    most = search.criteria.most
    return bool(left - count <= max((1.0 - most) * (looks.alike.cost - count), (CLOSE - 1.0) * count))


def left_by(looks: Looks, laws: Tried) -> float:
    """Return the squared error after the laws' own steps; the gains of several are added."""
    return laws[0][1].cost - sum(looks.alike.cost - fitted.cost for _, fitted in laws[1:])


def further(looks: Looks, candidate: Candidate, fitted: Fit) -> tuple[Candidate, Fit]:
    """Fit a law further, with its details free: an alternative fits as well only once other parameters have moved."""
    own = fitted.unknowns[len(looks.frozen.unknowns) :]
    detailed, model, unknowns = with_details(candidate, fitted.model) or (candidate, fitted.model, own)
    return detailed, fit(looks.problem, model, unknowns, MORE_STEPS, looks.frozen)


def refitted(search: Search, looks: Looks, laws: Tried) -> Proposal:
    """Refit the parent with some more laws, begun where their own steps led; what they move of the constants is added.

    Where the set fits worse there than the parent, it begins a smaller part of the way from it.
    """
    parent, unknowns = looks.frozen.model, looks.frozen.unknowns
    terms = [term for _, fitted in laws for term in fitted.model.terms[len(parent.terms) :]]
    values = read_all(parent, unknowns)
    moved = sum(read_all(fitted.model, unknowns) - values for _, fitted in laws)
    for share in SHARES:
        added = replace(parent, terms=(*parent.terms, *(smaller(term, share) for term in terms)))
        model = put_all(added, unknowns, values + share * moved)
        if search.cost(model) < looks.parent.fit.cost:
            break
    return noted(search, refit(search, (*looks.parent.effects, *(candidate for candidate, _ in laws)), model))


def smaller(term: Term, share: float) -> Term:
    """Return a term with a share of the parameters that set its size, those that are neutral at zero."""
    sizes = {p.name for p in term.effect.parameters if p.neutral == 0.0}.intersection(term.fitted)
    return replace(term, values={name: v * share if name in sizes else v for name, v in term.values.items()})


def refit(search: Search, effects: Sequence[Candidate], model: Model) -> Proposal:
    """Refit a set of effects from a model; return the best fit that is known of it."""
    one, laws = Proposal(tuple(effects), search.refitted(model)), in_forms(effects)
    search.fits[laws] = min(one, search.fits.get(laws, one), key=lambda known: known.fit.cost)
    return search.fits[laws]


def in_forms(effects: Sequence[Candidate]) -> frozenset[tuple[str, tuple[str, ...], tuple[str, ...]]]:
    """Return the keys of a set's laws, whatever their order."""
    return frozenset(map(key, effects))


def noted(search: Search, one: Proposal) -> Proposal:
    """Report a set, and note it if it is the best so far, its parameters counted."""
    left, price = search.over_noise(one.fit), one.price(search.criteria)
    if price < search.least:
        search.least = price
        search.stand(f"{one.label} ({left:.2f} x sensor noise on fitted trials)", "other laws and pairs of them")
    search.say(f"  {left:8.3f}  {one.label}")
    return one


def detailed(search: Search, one: Proposal) -> Proposal | None:
    """Refit a set with the details of its last law free; None if it has none."""
    if not (richer := with_details(one.effects[-1], one.fit.model)):
        return None
    candidate, model, _ = richer
    return noted(search, refit(search, (*one.effects[:-1], candidate), model))


def sets(looks: Looks, criteria: Criteria) -> list[Tried]:
    """Return the most promising pairs of laws, and of one law at several joints, without simulating them.

    The change that each law makes is known from its own fit; the laws of a set are scaled by least squares, and the
    error is predicted by leaving out one trial at a time, from products summed trial by trial.
    Source: Allen, The relationship between variable selection and data augmentation and a method for prediction,
    Technometrics 16, 1974 (the PRESS statistic).
    """
    problem, laws = looks.problem, looks.tried
    if len(laws) < 2:
        return []
    gradient, gram = products(problem, looks.alike, [fitted for _, fitted in laws])
    expected = noise_inflation(problem, looks.alike.cost)
    alone = np.array([press(gradient[:, [k]], gram[:, [k]][:, :, [k]], expected) for k in range(len(laws))])
    gains = []
    for rows in wanted_sets([candidate for candidate, _ in laws]):
        part = np.ix_(range(len(gram)), rows, rows)
        gained = press(gradient[:, rows], gram[part], expected)
        if gained > alone[rows].max():
            gains.append((gained, tuple(laws[k] for k in rows)))
    first: dict[frozenset[tuple[str, str]], tuple[float, Tried]] = {}
    for gained, together in sorted(gains, key=lambda one: -one[0]):
        effects = [candidate for candidate, _ in together]
        first.setdefault(named_by(effects), (priced(looks.alike.cost - gained, effects, criteria), together))
    cheapest = sorted(first, key=lambda names: first[names][0])
    return [first[names][1] for names in dict.fromkeys([*[*first][:LEAVE_LEAST], *cheapest[:CHEAPEST]])]


def wanted_sets(laws: Sequence[Candidate]) -> Iterator[list[int]]:
    """Yield indices of laws that may act together: pairs in their best forms, one law at three joints or more.

    The laws are sorted, best first.
    """
    best: dict[tuple[str, tuple[str, ...]], int] = {}
    for place, law in enumerate(laws):
        best.setdefault((law.effect.name, law.joints), place)
    yield from (list(pair) for pair in combinations(best.values(), 2))
    yield from (places for places in of_a_kind(laws) if len(places) > 2)


def of_a_kind(laws: Sequence[Candidate]) -> list[list[int]]:
    """Return, for each law and form, the indices of the joints where it was tried."""
    kinds: dict[tuple[str, tuple[str, ...]], dict[tuple[str, ...], int]] = {}
    for place, law in enumerate(laws):
        kinds.setdefault((law.effect.name, tuple(law.form)), {}).setdefault(law.joints, place)
    return [list(places.values()) for places in kinds.values()]


def products(problem: Problem, frozen: Fit, fits: Sequence[Fit]) -> tuple[Array, Array]:
    """Return gradients (T, C) and Gram matrices (T, C, C) of C laws by trial, constants and starts projected out."""
    residual = frozen.residual
    changes = np.stack([residual - one.residual for one in fits], axis=-1)
    weight = noise_inflation(problem, frozen.cost) * precision(frozen.unknowns)
    information = frozen.information + np.diag(weight)
    joined = np.concatenate([residual[..., None], changes], axis=-1)
    cross = np.einsum("grp,grc->pc", problem.free(frozen.columns), joined, optimize=True)
    joined = joined - frozen.columns @ np.linalg.solve(information, cross)
    freed = problem.free(joined)
    each = np.einsum("grc,grd->gcd", joined, freed, optimize=True)
    by_trial = np.stack([each[problem.segment_trial == k].sum(axis=0) for k in np.unique(problem.segment_trial)])
    return by_trial[:, 0, 1:], by_trial[:, 1:, 1:]


def press(gradient: Array, gram: Array, expected: float) -> float:
    """Return the leave-one-trial-out gain of columns with gradients (T, C) and Gram matrices (T, C, C).

    Each law has the size of its own fit, so factors are limited to 0 to `LARGER`.
    """
    total, whole = gradient.sum(axis=0), gram.sum(axis=0) + expected * np.eye(gram.shape[1])
    others = (whole - gram, total - gradient) if len(gradient) > 1 else (whole[None], total[None])
    factors = np.clip(np.linalg.solve(others[0], others[1][..., None])[..., 0], 0.0, LARGER)
    return float(np.sum(2.0 * factors * gradient) - np.einsum("tc,tcd,td->", factors, gram, factors))


def without(search: Search, one: Proposal, *places: int) -> Proposal:
    """Refit a set without some of its effects; return what is known of it if it was refitted before."""
    model, effects = one.fit.model, one.effects
    for place in sorted(places, reverse=True):
        model, effects = without_effect(model, effects, place), (*effects[:place], *effects[place + 1 :])
    return search.fits.get(in_forms(effects)) or refit(search, effects, model)
