"""Forward selection of effects: single laws, growing sets, and one comparison on held-out trials."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student_t

from tactile_cube.drivetrain.effects.effect import Array, Effect
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.fitting.resolution import NORMAL_95, standard_errors
from tactile_cube.identification.search.candidates import Candidate, Score, Sizes, first_term
from tactile_cube.identification.search.evidence import Judgement, as_good, worse
from tactile_cube.identification.search.explanation import (
    Explanation,
    Proposal,
    nameable,
    named_by,
    proven,
    simplest,
    sound,
    unproven,
)
from tactile_cube.identification.search.proposals import (
    CLOSE,
    Looks,
    Tried,
    detailed,
    explains_most,
    further,
    grown,
    left_by,
    look,
    near,
    noted,
    of_a_kind,
    off,
    refit,
    refitted,
    whole,
    without,
)
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, Term

MOST = 4  # laws in a set beside those of the standard model, each at all the joints where it improves the fit
JUDGED = 6  # cheapest sets that are scored on held-out trials, and most alternatives to one of the chosen effects


@dataclass(frozen=True)
class Findings:
    """Results of a search.

    Attributes:
        base: the refitted base model.
        nominal: the model before any fit, judged on the held-out trials.
        judged: sets scored on the held-out trials.
        scores: first-order gain of every law, best first.
        looked: number of laws screened, for the correction of multiple comparisons.
        stopped: next step when the simulation budget ran out; empty if the search finished.
    """

    base: Explanation
    nominal: Judgement
    judged: tuple[Explanation, ...] = ()
    scores: tuple[Score, ...] = ()
    looked: int = 1
    stopped: str = ""

    def proven(self, criteria: Criteria = STANDARD) -> list[Explanation]:
        """Return the significant sets, best first; only a shared offset if the base model is at the noise floor.

        Once one set proves that something is missing, a set as good as the best one with as few effects counts as
        significant too: its own p-value may be high only because it was compared over few blocks.
        """
        found = [one for one in self.judged if proven(one, criteria)]
        if self.base.largest_error <= criteria.floor:
            found = [one for one in found if one.judgement is self.base.judgement]
        elif found:
            best = min(found, key=lambda one: one.judgement.costs.sum())
            found += [
                one
                for one in self.judged
                if not proven(one, criteria)
                and as_good(one.judgement, best.judgement, criteria)
                and len(named_by(one.effects)) <= len(named_by(best.effects))
            ]
        return sorted(found, key=lambda one: one.judgement.costs.sum())

    def kept(self, criteria: Criteria = STANDARD) -> list[Explanation]:
        """Return the significant sets that are not clearly worse than the best."""
        found = self.proven(criteria)
        return [one for one in found if not worse(one.judgement, found[0].judgement, criteria)]

    def unproven(self, criteria: Criteria = STANDARD) -> list[Explanation]:
        """Return large improvements that are not significant, best first; none if any set is significant."""
        doubtful = [] if self.proven(criteria) else [one for one in self.judged if unproven(one, criteria)]
        return sorted(doubtful, key=lambda one: one.error)


def find(search: Search, standard: Proposal | None = None) -> Findings:
    """Search a recording for the effects that its model lacks.

    The field's `standard` model is one of the sets; where it is better than each law and pair, the search goes on
    beside it.
    """
    base, nominal = search.base, search.judged(search.start)
    search.say(f"base refitted: held-out error {base.error:.2f} x sensor noise")
    if base.largest_error <= search.criteria.floor:
        shared = shared_offset(base, search.fitted, search.effects, search.shooting.sizes)
        return Findings(base, nominal, (shared, *in_place_of(search, shared)) if shared else ())
    search.stand(f"constants refitted ({base.error:.2f} x sensor noise on held-out trials)", "every law by itself")
    way, first = proposed(search, standard)
    looked = max(first.laws, 1) if first else 1
    found = Findings(
        base,
        nominal,
        tuple(search.explained(one, looked) for one in to_be_judged(way, search, standard)),
        tuple(first.scores) if first else (),
        looked,
    )
    chosen: Explanation | None = None
    while first and not search.spent and (good := found.proven(search.criteria)):
        before, chosen = chosen, simplest(sound(good, base, search.criteria, looked), search.criteria)
        search.stand(f"{chosen.label} ({chosen.error:.2f} x sensor noise on held-out trials)", "its possible twins")
        if chosen is before or not nameable(chosen, base, search.criteria):
            break
        others = tuple(search.explained(one, looked) for one in twins(search, chosen, first, found.judged))
        found = replace(found, judged=(*found.judged, *others))
    return replace(found, stopped=search.following if search.spent else "")


def proposed(search: Search, standard: Proposal | None) -> tuple[list[Proposal], Looks | None]:
    """Return candidate sets, ranked on the fitted trials alone, and the screening of single laws."""
    parent, usual = Proposal((), search.base.fit), {one.effect.name for one in standard.effects} if standard else set()
    found: list[Proposal] = []
    first: Looks | None = None
    for _ in range(MOST):
        places = off(search, parent.fit)
        if not places or laws_of(parent, usual) >= MOST or search.spent:
            break
        looks = look(search, parent, [search.fitted.joints[j] for j in places])
        first = first or looks
        if not looks.tried:
            break
        search.say(f"{len(looks.scores)} starts of {looks.laws} laws beside {parent.label}")
        tried = [one for one in grown(search, looks) if laws_of(one, usual) <= MOST]
        if standard and looks is first and not whole(search, tried) and not search.spent:
            usually = noted(search, refit(search, standard.effects, standard.fit.model))
            tried = sorted([*tried, usually], key=lambda one: one.price(search.criteria))
        if tried and len(tried[0].effects) > len(parent.effects) + 1 and (richer := detailed(search, tried[0])):
            tried = sorted([*tried, richer], key=lambda one: one.price(search.criteria))
        found += tried
        if not tried or tried[0].price(search.criteria) >= parent.price(search.criteria):
            break
        before, parent = parent, tried[0]
        if out_of_reach(search, before, parent, MOST - laws_of(parent, usual)) or in_detail(search, before, parent):
            break
        search.say.following = "one effect more, and each one taken out"
    return [*found, *reduced(search, parent)], first


def out_of_reach(search: Search, before: Proposal, one: Proposal, more: int) -> bool:
    """Return whether a set cannot explain enough to be named, even if so many more laws explain as much as the last.

    Laws are added in the order of what they explain, so the next ones explain less.
    """
    criteria, rows = search.criteria, np.count_nonzero(search.problem.weight)
    taken = (before.fit.cost - one.fit.cost) / max(laws_of(one) - laws_of(before), 1)
    left = one.fit.cost - more * taken - rows
    enough = max((1.0 - criteria.most) * (search.base.fit.cost - rows), (criteria.tolerated**2 - 1.0) * rows)
    return bool(left > enough)


def in_detail(search: Search, before: Proposal, one: Proposal) -> bool:
    """Return whether a set explained nearly everything and the laws added to it explain less than most of the rest.

    The rest is then a difference in form between its laws and the machine, of which any further law explains a part.
    """
    criteria, rows = search.criteria, np.count_nonzero(search.problem.weight)
    rest = before.fit.cost - rows
    nearly_whole = rest <= (1.0 - criteria.nearly_whole) * (search.base.fit.cost - rows)
    return bool(nearly_whole and before.fit.cost - one.fit.cost < criteria.most * rest)


def laws_of(one: Proposal, usual: Collection[str] = ()) -> int:
    """Return the number of laws in a set beside the usual ones, however many joints they act at."""
    return len({effect.effect.name for effect in one.effects}.difference(usual))


def reduced(search: Search, one: Proposal) -> list[Proposal]:
    """Return the sets of a backward elimination: one effect after another removed, the least important first."""
    found: list[Proposal] = []
    while (laws_of(one) > 1 or 1 < len(one.effects) <= MOST) and not search.spent:
        less = [without(search, one, *places) for places in together(one.effects)]
        found += less
        one = min(less, key=lambda e: e.fit.cost)
    return found


def together(effects: Sequence[Candidate]) -> list[list[int]]:
    """Return indices of effects to remove together: one at a time, or all of one law in sets of more than `MOST`."""
    if len(effects) <= MOST:
        return [[place] for place in range(len(effects))]
    names = [effect.effect.name for effect in effects]
    return [[place for place, name in enumerate(names) if name == law] for law in dict.fromkeys(names)]


def to_be_judged(found: Sequence[Proposal], search: Search, standard: Proposal | None) -> list[Proposal]:
    """Return the sets to score: the `JUDGED` cheapest, the cheapest of each number of laws, and the standard model."""
    cheapest: dict[frozenset[tuple[str, str]], Proposal] = {}
    for one in sorted(found, key=lambda one: one.price(search.criteria)):
        cheapest.setdefault(named_by(one.effects), one)
    sets, first = list(cheapest.values()), dict[int, int]()
    for place, one in enumerate(sets):
        first.setdefault(laws_of(one), place)
    usual = named_by(standard.effects) if standard else None
    also = (place for place, one in enumerate(sets) if named_by(one.effects) == usual)
    return [sets[place] for place in sorted({*range(min(JUDGED, len(sets))), *first.values(), *also})]


def twins(search: Search, chosen: Explanation, first: Looks, judged: Sequence[Explanation]) -> list[Proposal]:
    """Return sets in which another law replaces a chosen one and fits as well after a full refit.

    Special cases of the chosen law come first and are always tried if its interval reaches the value at which it
    becomes them, as is the set without the effect. A law with many more parameters is not tried; what was judged with
    many more is tried with fewer.
    """
    known = {named_by(one.effects) for one in judged if one.size <= chosen.size + 1}
    found: list[Proposal] = []
    for places in together(chosen.effects):
        replaced, looks = [chosen.effects[place] for place in places], first
        simpler = set.intersection(*(simpler_laws(search, chosen, place) for place in places))
        if len(places) < len(chosen.effects):
            joints = [joint for effect in replaced for joint in effect.joints]
            looks = look(search, without(search, chosen, *places), joints)
            if (left := named_by(looks.parent.effects)) not in known:
                known.add(left)
                found.append(looks.parent)
        most = sum(effect.size for effect in replaced) + 1
        laws = [
            one
            for one in instead(looks, replaced)
            if one[0][0].effect.name in simpler
            or (sum(law.size for law, _ in one) <= most and explains_most(search, looks, left_by(looks, one)))
        ]
        contained = replaced[0].effect.contains
        laws.sort(key=lambda one: (one[0][0].effect.name not in simpler, one[0][0].effect.name not in contained))
        for one in laws[: 2 * JUDGED]:
            names = named_by((*looks.parent.effects, *(law for law, _ in one)))
            if len(found) >= JUDGED or names in known or search.spent:
                continue
            known.add(names)
            if not near(looks, left_by(looks, one), [chosen]):
                one = tuple(further(looks, law, fitted) for law, fitted in one)
            if one[0][0].effect.name in simpler or near(looks, left_by(looks, one), [chosen]):
                found.append(refitted(search, looks, one))
    return [one for one in found if one.fit.cost <= CLOSE * chosen.fit.cost]


def instead(looks: Looks, replaced: Sequence[Candidate]) -> list[Tried]:
    """Return replacements, best first: any law for a single effect, one law at as many joints for several."""
    if len(replaced) == 1:
        return [(one,) for one in looks.tried]
    kinds = [places for places in of_a_kind([law for law, _ in looks.tried]) if len(places) == len(replaced)]
    return sorted((tuple(looks.tried[k] for k in kind) for kind in kinds), key=lambda one: left_by(looks, one))


def simpler_laws(search: Search, chosen: Explanation, place: int) -> set[str]:
    """Return the special cases of an effect that its intervals include; those of a table always count."""
    fitted, effect = search.frozen(chosen.fit), chosen.effects[place].effect
    width = NORMAL_95 * standard_errors(search.problem, fitted) * np.array([u.scale for u in fitted.unknowns])
    tables = {name for name, values in effect.contains.items() if not values}
    return tables | reached(effect, fitted, width, first_term(fitted.model, chosen.effects, place))


def reached(effect: type[Effect], fitted: Fit, half_width: Array, term: int) -> set[str]:
    """Return the special cases of an effect, a fit's `term`, whose values lie within its intervals (P,)."""
    reach = [
        (u.key, u.of(fitted.model), half, u.high)
        for u, half in zip(fitted.unknowns, half_width, strict=True)
        if u.kind == "effect" and u.place == term
    ]
    return {
        name
        for name, values in effect.contains.items()
        if any(k in values and abs(min(values[k], high) - at) <= half for k, at, half, high in reach)
    }


LEAST = 0.012  # [rad] of a finger: smaller joint offsets are ordinary
UNLIKELY = 0.001  # p-value over all joints below which offsets are not explained by initialisation
STRIKING, DOUBTFUL = 0.03, 0.1  # [rad] of a finger and p-value: offsets between them are mentioned


@dataclass(frozen=True)
class CommonOffset:
    """Joint offset that is similar in every initialisation.

    Attributes:
        joint: its name.
        offset: mean, as position_offset counts it [rad].
        initialisations: number that agree.
        by_chance: p-value of the agreement.
    """

    joint: str
    offset: float
    initialisations: int
    by_chance: float


def shared_offset(
    base: Explanation, fitted: Recording, effects: Sequence[type[Effect]], sizes: Sizes
) -> Explanation | None:
    """Return the base model with an encoder offset at joints whose initialisations agree; None if there are none.

    Offsets that differ between initialisations come from initialising and are no model error. Student's t decides
    whether two or three similar ones are significant.
    """
    effect = next((effect for effect in effects if effect.constant_reading), None)
    if effect is None or len(base.judgement.model.offsets) < 2:
        return None
    mean, by_chance = _mean_and_chance(base, sizes)
    least = LEAST * np.array([sizes[joint].of("rad") for joint in fitted.joints])
    shared = (np.abs(mean) > least) & (by_chance < UNLIKELY)
    if not shared.any():
        return None
    places = np.flatnonzero(shared)
    joints = tuple(fitted.joints[j] for j in places)
    name = effect.constant_reading
    terms = tuple(Term(effect, fitted.joints[j], {name: float(mean[j])}, (name,)) for j in places)
    offsets = {key: value + np.where(shared, mean, 0.0) for key, value in base.fit.model.offsets.items()}
    model = Model(base.fit.model.constants, (*base.fit.model.terms, *terms), offsets)
    candidate = Candidate(effect, joints, {name: float(np.abs(mean[shared]).max())}, sizes)
    fit = replace(base.fit, model=model)
    return replace(base, effects=(*base.effects, candidate), fit=fit, p_value=float(by_chance[shared].max()), gain=1.0)


def in_place_of(search: Search, shared: Explanation) -> list[Explanation]:
    """Return the base model with another law that leaves no shared offset: a mount that leans, where weight is all.

    They predict the same motion, so each is as certain as the `shared` offset of an encoder.
    """
    base, first = search.base, len(search.base.fit.model.terms)
    model = replace(shared.fit.model, terms=shared.fit.model.terms[:first])
    unknowns = tuple(u for u in base.fit.unknowns if u.kind != "offset")
    parent = Proposal(base.effects, replace(base.fit, model=model, unknowns=unknowns))
    looks = look(search, parent, shared.effects[-1].joints)
    others = [search.explained(one, looks.laws) for one in twins(search, shared, looks, [shared])]
    return [
        replace(one, judgement=base.judgement, p_value=shared.p_value, gain=shared.gain)
        for one in others
        if as_good(one.judgement, base.judgement, search.criteria)
        and shared_offset(one, search.fitted, search.effects, search.shooting.sizes) is None
    ]


def common_offsets(base: Explanation, sizes: Sizes) -> tuple[CommonOffset, ...]:
    """Return large offsets that agree between initialisations but not significantly."""
    count = len(base.judgement.model.offsets)
    if count < 2:
        return ()
    mean, by_chance = _mean_and_chance(base, sizes)
    return tuple(
        CommonOffset(joint, float(mean[j]), count, float(by_chance[j]))
        for j, (joint, scales) in enumerate(sizes.items())
        if abs(mean[j]) > STRIKING * scales.of("rad") and UNLIKELY <= by_chance[j] < DOUBTFUL
    )


def _mean_and_chance(base: Explanation, sizes: Sizes) -> tuple[Array, Array]:
    """Return mean offsets (n,) over the initialisations and the p-values (n,) of their agreement (Student's t).

    The scatter is pooled over the joints of a machine, each in its own scale; a joint's own scatter counts if it is
    larger.
    """
    scale = np.array([one.of("rad") for one in sizes.values()])
    offsets = -np.array([base.judgement.model.offsets[k] for k in sorted(base.judgement.model.offsets)]) / scale
    mean, variance = offsets.mean(axis=0), offsets.var(axis=0, ddof=1)
    scatter = np.sqrt(np.maximum(variance, variance.mean()))
    ratio = np.abs(mean) / np.maximum(scatter, 1e-9) * np.sqrt(len(offsets))
    freedom = (len(offsets) - 1) * len(mean)
    return mean * scale, np.minimum(1.0, 2.0 * student_t.sf(ratio, freedom) * len(mean))
