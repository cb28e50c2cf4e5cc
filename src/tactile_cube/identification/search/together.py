"""Effects from everything at once: the field's standard model, and sets that are proposed by their fit alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import fit
from tactile_cube.identification.search.candidates import Candidate, joined, with_effects, without_effect
from tactile_cube.identification.search.division import BRIEF, Division
from tactile_cube.identification.search.evidence import Judgement, all_of, gain, p_value, worse
from tactile_cube.identification.search.explanation import Explanation, Proposal, named, named_by, needless
from tactile_cube.identification.search.residual_shape import Motion, logged_motion
from tactile_cube.identification.search.residual_starts import residual_candidates
from tactile_cube.identification.search.screening import best_subsets, candidate_columns
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.replay.model import Model

Array = NDArray[np.float64]
MOST = 4  # effects in a set; one more than are looked for one by one, for pruning takes back what was too much
REFITTED = 6  # sets of each size that are refitted briefly, of which the best ones go on
KEPT = 2  # sets that are grown further
JUDGED = 4  # sets that the held-out trials are asked about


class Together:
    """The search from everything at once, beside one that adds effects one by one.

    Effects that help only together are never found one by one, for the first of them alone is no gain. So sets grow
    here by their fit alone, by one effect or two at a time; what the held-out trials are asked about is the end of it:
    few sets, pruned of all that they do not need. Where a single division leaves too few segments to tell, every part
    of the trials is held out in turn (cross-validation), and all of them judge.
    """

    def __init__(self, search: Search, base: Explanation, folds: Sequence[Division]) -> None:
        """Take what is known from the search one by one.

        Args:
            search: the recording and its effects.
            base: the refitted base model.
            folds: further divisions of the same trials; may be none.
        """
        self.search, self.base, self.criteria = search, base, search.criteria
        self.folds, few = list(folds), (base.judgement.samples > 0).sum() < search.criteria.few_segments
        self.folds = self.folds if few else []
        others = [fold.fit_base().judgement for fold in self.folds]
        self.base_evidence = all_of([base.judgement, *others])

    def run(
        self, leaders: Sequence[Proposal], best: Explanation
    ) -> tuple[tuple[Explanation, ...], tuple[Explanation, ...]]:
        """Sets that earn their place, best first: those clearly better than the best one known, and all others.

        Args:
            leaders: single effects that fit best.
            best: what the search one by one came to; the base model if nothing.
        """
        self.search.say(f"far from the noise; which effects together? {1 + len(self.folds)} division(s) of the trials")
        proposals = [one for one in self.proposals(leaders) if one.effects][:JUDGED]
        judged = [self.pruned(one, self.evidence(one.fit.model)) for one in proposals]
        known = self.evidence(best.fit.model) if best.effects else self.base_evidence
        found: dict[frozenset[tuple[str, str]], tuple[Explanation, Judgement]] = {}
        for one, evidence in judged:
            explanation = self.explanation(one, evidence, len(proposals))
            if self.search.worthwhile(explanation, self.base, self.base):
                found.setdefault(named_by(one.effects), (explanation, evidence))
        ordered = sorted(found.values(), key=lambda pair: pair[1].costs.sum())
        better = [pair for pair in ordered if worse(known, pair[1], self.criteria)]
        clear = tuple(one for one, evidence in better if not worse(evidence, better[0][1], self.criteria))
        return clear, tuple(one for one, _ in ordered if one not in clear)

    def proposals(self, leaders: Sequence[Proposal]) -> list[Proposal]:
        """Sets by their fit, grown as long as that pays."""
        kept = self.best([*leaders, *self.grown(Proposal((), self.base.fit), sizes=(2,))])
        grown = kept
        while grown:
            grown = [one for parent in grown[:KEPT] for one in self.grown(parent, sizes=(1, 2))]
            grown = [one for one in self.best(grown) if one.price(self.criteria) < kept[0].price(self.criteria)]
            kept = self.best([*kept, *grown])
        return kept

    def best(self, proposals: Sequence[Proposal]) -> list[Proposal]:
        """The cheapest of those that name the same effects, cheapest first."""
        cheapest: dict[frozenset[tuple[str, str]], Proposal] = {}
        for one in sorted(proposals, key=lambda one: one.price(self.criteria)):
            cheapest.setdefault(named_by(one.effects), one)
        return list(cheapest.values())

    def grown(self, parent: Proposal, sizes: Sequence[int]) -> list[Proposal]:
        """A set with one or two effects more: the sets that promise most refitted, the best of them in full."""
        search, problem = self.search, self.search.problem
        sizes = [size for size in sizes if len(parent.effects) + size <= MOST]
        if not sizes:
            return []
        frozen = search.frozen(parent.fit)
        there = named_by(parent.effects)
        wanted = [*search.candidates, *residual_candidates(problem, search.fitted, frozen, search.effects)]
        wanted = [one for one in search.new(wanted) if there.isdisjoint(named_by([one]))]
        columns, brief = candidate_columns(problem, frozen, wanted), []
        for _, chosen in (one for size in sizes for one in best_subsets(columns, size)[:REFITTED]):
            model = with_effects(frozen.model, chosen)
            own = search.unknowns(model)[len(frozen.unknowns) :]
            brief.append(Proposal((*parent.effects, *chosen), fit(problem, model, own, BRIEF, frozen)))
        leading = self.best(brief)[:KEPT]
        full = [replace(one, fit=search.refitted(one.fit.model)) for one in leading]
        for one in full:
            search.say(f"  {search.over_noise(one.fit):8.3f}  {' & '.join(c.label for c in one.effects)}")
        return full

    def evidence(self, model: Model) -> Judgement:
        """How a model does on the held-out trials of all divisions, refitted in each."""
        folds = [fold.settled(model.with_offsets(fold.offsets))[1] for fold in self.folds]
        return all_of([self.search.settled(model)[1], *folds])

    def pruned(self, proposal: Proposal, evidence: Judgement) -> tuple[Proposal, Judgement]:
        """As simple as the held-out trials allow: without an effect, or with a special case of its law instead.

        Which effect is needed least, and which special case does best, the fit says; the held-out trials say whether.
        """
        pruned, left = proposal, evidence
        while simpler := self.simpler(pruned, proposal, evidence):
            pruned, left = simpler
        return pruned, left

    def simpler(self, pruned: Proposal, whole: Proposal, evidence: Judgement) -> tuple[Proposal, Judgement] | None:
        """One step of it, held against the evidence of the whole; None where there is none."""
        places = range(len(pruned.effects) if len(pruned.effects) > 1 else 0)
        without = [self.without(pruned, place) for place in places]
        for tried in (without, self.special(pruned)):
            if tried:
                next_one = min(tried, key=lambda one: one.fit.cost)
                less = self.evidence(next_one.fit.model)
                removed = [one for one in whole.effects if one not in next_one.effects]
                if needless(evidence, less, self.search.fitted.joints, removed, self.criteria):
                    return next_one, less
        return None

    def without(self, proposal: Proposal, place: int) -> Proposal:
        """The set without one of its effects, refitted."""
        model = without_effect(proposal.fit.model, proposal.effects, place)
        left = proposal.effects[:place] + proposal.effects[place + 1 :]
        return Proposal(left, self.search.refitted(model))

    def special(self, proposal: Proposal) -> list[Proposal]:
        """The set with one of its effects exchanged for one that its law contains, refitted."""
        return [
            Proposal(effects, self.search.refitted(model))
            for place in range(len(proposal.effects))
            for effects, model in self.search.special_cases(proposal.fit.model, proposal.effects, place)
        ]

    def explanation(self, one: Proposal, evidence: Judgement, judged: int) -> Explanation:
        """A set with its evidence, of which so many sets are judged."""
        corrected = min(1.0, p_value(self.base_evidence, evidence) * judged)
        own = self.search.judged(one.fit.model)
        found = Explanation(one.effects, one.fit, own, corrected, gain(self.base_evidence, evidence))
        self.search.say(f"  held-out error {evidence.error:.3f}  p {corrected:.1e}  {found.label}")
        return found


WEAKEST = 0.3  # part of a drive's torque that a regression may take for its strength
MOVES = 0.05  # of a joint's speed: slower samples say little of its friction


def standard_explanations(search: Search, base: Explanation) -> tuple[Explanation, ...]:
    """Return what of the standard model the recording's owner states wrongly: what of it is proven, then all of it.

    All laws are regressed on the torque that the measured motion takes, joint by joint. What is needed for it is fitted
    at all joints at once; unless that explains nearly all, it stays at joints of which it does.

    Source: Gautier, Dynamic identification of robots with power model, ICRA 1997; viscous friction by direction as in
    Janot, Gautier, Brunot, EMPS benchmark, 2019.
    """
    known = {effect.name: effect for effect in search.effects}
    motion = logged_motion(search.problem, search.fitted, base.fit.model)
    wanted = search.new(
        [
            Candidate(known[name], (joint,), form, search.shooting.sizes)
            for j, joint in enumerate(search.fitted.joints)
            for name, form in regressed(motion, j, search.criteria).items()
            if name in known
        ]
    )
    if not wanted:
        return ()
    search.say(f"standard model: {' & '.join(one.label for one in wanted)}")
    found = _of_laws(search, base, wanted)
    if found.explained(base) <= search.criteria.most:
        left, before = (one.judgement.joint_errors**2 - 1.0 for one in (found, base))
        followed = 1.0 - left / np.maximum(before, 1e-9) > search.criteria.most
        good = [one for one in wanted if followed[search.fitted.joints.index(one.joints[0])]]
        if not good:
            return ()
        found = _of_laws(search, base, good)
    if not search.worthwhile(found, base, base):
        return ()
    proven = search.pruned(found)
    return (proven,) if named(proven) == named(found) else (proven, replace(found, effects=joined(found.effects)))


def _of_laws(search: Search, base: Explanation, laws: Sequence[Candidate]) -> Explanation:
    """The base model with laws, everything fitted."""
    fitted = search.refitted(with_effects(base.fit.model, laws))
    return search.explanation(base, tuple(laws), fitted.model, 1)


def regressed(motion: Motion, j: int, criteria: Criteria = STANDARD) -> dict[str, dict[str, float]]:
    """Return effect -> parameters of the laws that the drive of joint number j needs, by least squares.

    Torque of the drive [N m] = (1 + k) taken + J a + Fc sgn v + b v + d / 2 |v| - bias, less b' v' and Fc' sgn v' of
    its neighbours in the chain, where it moves. Of these numbers those stay without which the squared error would grow
    by a large part of itself.
    """
    speed, n = np.abs(motion.velocity[:, j]), motion.velocity.shape[1]
    moving = speed > MOVES * speed.max()
    velocity, direction = motion.velocity[moving].T, motion.direction[moving].T
    taken = motion.taken[moving, j]
    lacking = taken - motion.drive[moving, j]
    sides = {side: k for side, k in (("previous", (j - 1) % n), ("next", (j + 1) % n)) if k != j}
    laws = {
        "taken": taken,
        "friction": direction[j],
        "damping": velocity[j],
        "difference": 0.5 * np.abs(velocity[j]),
        "bias": -np.ones_like(taken),
        "excess": motion.acceleration[moving, j],
        **{f"damping_{side}": -velocity[k] for side, k in sides.items()},
        **{f"friction_{side}": -direction[k] for side, k in sides.items()},
    }
    columns = np.stack([*laws.values()], axis=1)
    sizes = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)

    def solved(kept: list[int]) -> tuple[float, Array]:
        numbers = np.zeros(len(sizes))
        numbers[kept] = np.linalg.lstsq(columns[:, kept] / sizes[kept], -lacking, rcond=1e-6)[0] / sizes[kept]
        return float(np.sum((lacking + columns @ numbers) ** 2)), numbers

    kept = [*range(len(sizes))]
    cost, numbers = solved(kept)
    while kept:
        without = {k: solved([one for one in kept if one != k]) for k in kept}
        least = min(without, key=lambda k: without[k][0])
        if without[least][0] >= (1.0 + criteria.large_gain) * cost:
            break
        kept.remove(least)
        cost, numbers = without[least]
    strength = 1.0 / max(1.0 + numbers[0], WEAKEST)  # of the drive, as which a gain is stated
    found = {name: float(strength * number) for name, number in zip(laws, numbers, strict=True) if number}
    found.pop("taken", None)
    if "friction" in found:
        found["friction"] = max(found["friction"], 0.0)
    if "difference" in found:
        found["damping"] = max(found.get("damping", 0.0), 0.5 * abs(found["difference"]))
    effects = {
        "coulomb_friction": ["friction"],
        "viscous_friction": ["damping", "difference"],
        "torque_bias": ["bias"],
        "reflected_inertia": ["excess"],
        "joint_coupling": [name for name in laws if "_" in name],
    }
    needed = {effect: {name: found[name] for name in names if name in found} for effect, names in effects.items()}
    needed["torque_gain"] = {"error": strength - 1.0} if numbers[0] else {}
    return {effect: form for effect, form in needed.items() if form}
