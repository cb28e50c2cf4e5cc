"""Effects from everything at once: the field's standard model, and sets that are proposed by their fit alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactile_cube.identification.fitting.gauss_newton import Fit, fit, precision
from tactile_cube.identification.search.candidates import Candidate, with_effects, without_effect
from tactile_cube.identification.search.division import BRIEF, Division
from tactile_cube.identification.search.evidence import Judgement, all_of, gain, p_value, worse
from tactile_cube.identification.search.explanation import Explanation, Proposal, named_by
from tactile_cube.identification.search.residual_shape import Missing, missing_torques
from tactile_cube.identification.search.residual_starts import residual_candidates
from tactile_cube.identification.search.screening import best_subsets, candidate_columns
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.replay.model import Model

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
        places = range(len(proposal.effects) if len(proposal.effects) > 1 else 0)
        without = [self.without(proposal, place) for place in places]
        for simpler in (without, self.special(proposal)):
            if simpler:
                next_one = min(simpler, key=lambda one: one.fit.cost)
                less = self.evidence(next_one.fit.model)
                if not worse(less, evidence, self.criteria):
                    return self.pruned(next_one, less)
        return proposal, evidence

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


ITERATIONS = 12
MOVES = 0.05  # of a joint's speed: slower samples say little of its friction


def standard_explanation(search: Search, base: Explanation) -> Explanation | None:
    """Return what of the standard model the recording's owner states wrongly, or None where that is no explanation.

    All laws are regressed on the torque that the base model lacks, then fitted at all joints at once. Those stay that
    the fit needs for its error, then those that the trials to judge by ask for.

    Source: Gautier, Dynamic identification of robots with power model, ICRA 1997; viscous friction by direction as in
    Janot, Gautier, Brunot, EMPS benchmark, 2019.
    """
    frozen = search.frozen(base.fit)
    missing = missing_torques(search.problem, search.fitted, frozen.model, frozen.residual)
    known = {effect.name: effect for effect in search.effects}
    wanted = [
        Candidate(known[name], (one.joint,), form, search.shooting.sizes)
        for one in missing
        for name, form in regressed(one).items()
        if name in known
    ]
    needed = _needed(search, frozen, search.new(wanted))
    if not needed:
        return None
    search.say(f"standard model: {' & '.join(one.label for one in needed)}")
    fitted = search.refitted(with_effects(base.fit.model, needed))
    found = search.pruned(search.explanation(base, tuple(needed), fitted.model, 1))
    enough = found.explained(base) > search.criteria.most and search.worthwhile(found, base, base)
    return found if enough else None


def regressed(missing: Missing) -> dict[str, dict[str, float]]:
    """Return effect -> parameters of the laws that are linear in the missing torque, by least squares.

    Torque (samples,) [N m] = -Fc sgn v - b v - d / 2 |v| + bias + g tau, of samples that move.
    """
    speed = missing.signals[f"velocity of {missing.joint} [rad/s]"]
    drive = missing.signals[f"torque of {missing.joint} [N m]"]
    moving = np.abs(speed) > MOVES * np.abs(speed).max()
    v = speed[moving]
    columns = np.stack([-np.sign(v), -v, -0.5 * np.abs(v), np.ones_like(v), drive[moving]], axis=1)
    sizes = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    friction, damping, difference, bias, gain = (
        np.linalg.lstsq(columns / sizes, missing.torque[moving], rcond=1e-6)[0] / sizes
    ).tolist()
    return {
        "coulomb_friction": {"friction": max(friction, 0.0)},
        "viscous_friction": {"damping": max(damping, 0.5 * abs(difference)), "difference": difference},
        "torque_bias": {"bias": bias},
        "torque_gain": {"error": float(np.clip(gain, -0.7, 0.7))},
    }


def _needed(search: Search, frozen: Fit, wanted: list[Candidate]) -> list[Candidate]:
    """Those of the laws, fitted together, without which the fit's squared error grows by a large part of itself."""
    left = list(wanted)
    while left:
        model = with_effects(frozen.model, left)
        fitted = fit(search.problem, model, search.unknowns(model)[len(frozen.unknowns) :], ITERATIONS, frozen)
        inverse = np.linalg.pinv(fitted.information + np.diag(precision(fitted.unknowns)))
        least = search.criteria.large_gain * fitted.cost
        worth, first = [], len(frozen.unknowns)
        for one in left:
            own = slice(first, first := first + one.size)
            values = np.array([u.of(fitted.model) / u.scale for u in fitted.unknowns[own]])
            worth.append(float(values @ np.linalg.solve(inverse[own, own], values)))
        kept = [one for one, cost in zip(left, worth, strict=True) if cost >= least]
        if len(kept) == len(left) or not kept:
            return kept
        left = kept
    return left
