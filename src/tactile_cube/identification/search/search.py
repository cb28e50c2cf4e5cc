"""The search for what is missing: screen, refit, judge on held-out trials, add, until the floor is reached."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.base import base_unknowns, nominal_model
from tactile_cube.identification.fitting.gauss_newton import Fit, fit, renewed
from tactile_cube.identification.fitting.model import Model, Unknown
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.identification.fitting.windows import Windows, cut
from tactile_cube.identification.search.candidates import Candidate, candidates, model_unknowns
from tactile_cube.identification.search.evidence import Judgement, gain, judge, p_value, worse
from tactile_cube.identification.search.explanation import NEARLY, Explanation
from tactile_cube.identification.search.other_starts import other_starts
from tactile_cube.identification.search.residual_starts import residual_candidates
from tactile_cube.identification.search.screening import Score, screen
from tactile_cube.identification.search.shared_offset import shared_offset
from tactile_cube.identification.search.shortlist import of_each, with_groups
from tactile_cube.identification.search.simplicity import simplest
from tactile_cube.identification.search.special_laws import special_candidates
from tactile_cube.identification.search.worth import least_gain, unproven, worthwhile
from tactile_cube.measurement.recordings.recording import Recording

Array = NDArray[np.float64]
REFITTED, RACED, FINALISTS = 14, 6, 4  # candidates that are refitted briefly, at length, and with everything free
BRIEF, LONG = 3, 8  # most iterations of a brief refit and of a long one; a fit that converges ends before
RESTARTED, PROBED = 2, 3  # finalists that are tried from other values, and the most promising of these values
FAR_BEHIND = 2.5  # squared error over the best one's at which a refitted candidate is given up
FAR_BEHIND_AT_FLOOR = 2.0  # the same where the best one explains nearly everything
SEGMENTS = 132  # enough data to search on, 52.8 s; the final fit takes all
DEEPEST = 3  # effects in combination
BEAM, CLOSE = 2, 1.5  # alternatives that are pursued at each depth, and their squared error over the best one's
RETRIED = 2  # first effects left behind that are pursued after all where the search ends far from the floor
LEFT = 0.5  # share of the squared error that they may leave alone


@dataclass(frozen=True)
class Findings:
    """Everything that a search has tried.

    Attributes:
        base: the refitted base model.
        nominal: the model before any fit, judged on the held-out trials.
        levels: explanations with 1, 2, ... effects, best first; at the end pairs that second thoughts found.
        scores: screening of the first level, best first.
        unproven: where the search ended, what would explain much and may be chance, best first.
    """

    base: Explanation
    nominal: Judgement
    levels: tuple[tuple[Explanation, ...], ...]
    scores: tuple[Score, ...]
    unproven: tuple[Explanation, ...] = ()


class Search:
    """A recording with its trials split, and the effects that may be missing."""

    criteria = STANDARD

    def __init__(
        self,
        fitted: Recording,
        held_out: Recording,
        noise: Array,
        effects: Sequence[type[Effect]],
        say: Callable[[str], None],
        known: ModelFile | None = None,
        criteria: Criteria = STANDARD,
    ) -> None:
        """Prepare the problems.

        Args:
            fitted: trials to fit.
            held_out: trials to judge by.
            noise: (n,) of the position sensors [rad].
            effects: classes to search.
            say: takes progress lines.
            known: the model to begin with; None: what the recording's owner states.
            criteria: what decides.
        """
        self.say, self.criteria = say, criteria
        self.fitted, self.held_out = fitted, held_out
        self.start, self.start_held_out = nominal_model(fitted, known), nominal_model(held_out, known)
        effects = tuple(dict.fromkeys([*effects, *(term.effect for term in self.start.terms)]))
        self.shooting = Shooting(fitted, effects)
        self.all_windows = cut(fitted, noise, time=self.shooting.time)
        self.problem = Problem(self.shooting, some(self.all_windows, SEGMENTS))
        self.judges = Problem(self.shooting, some(cut(held_out, noise, time=self.shooting.time), SEGMENTS))
        self.effects = effects
        self.candidates = candidates(self.shooting.sizes, effects)
        self.offsets = dict(self.start_held_out.offsets)
        self.last_scores: list[Score] = []
        self.last_behind: list[tuple[Candidate, Fit]] = []
        self.left_behind: list[tuple[Candidate, Fit]] = []

    def run(self) -> Findings:
        """The whole search."""
        base = self.fit_base()
        nominal = judge(self.judges, self.held_out, self.with_known_offsets(self.start))
        levels: list[tuple[Explanation, ...]] = []
        scores: tuple[Score, ...] = ()
        doubtful: list[Explanation] = []
        beam: tuple[Explanation, ...] = (base,)
        while len(levels) < DEEPEST and not any(e.error <= self.criteria.floor for e in beam):
            found = [(parent, e) for parent in beam for e in self.extend(parent, base)]
            if not scores:
                scores = tuple(self.last_scores)
                self.left_behind = list(self.last_behind)
            better = [e for parent, e in found if self.worthwhile(e, parent, base)]
            if not better:
                doubtful = [e for parent, e in found if unproven(e, parent, self.criteria)]
                break
            better.sort(key=lambda e: e.judgement.costs.sum())
            better[0] = self.pruned(better[0])
            levels.append(tuple(better))
            least = better[0].judgement.costs.sum()
            beam = tuple(e for e in pursued(better, self.criteria)[:BEAM] if e.judgement.costs.sum() < CLOSE * least)
        if levels and min(e.error for level in levels for e in level) > self.criteria.far:
            levels += [level] if (level := self.second_thoughts(base)) else []
        if not levels and base.error <= self.criteria.floor:
            shared = shared_offset(base, self.fitted, self.effects, self.shooting.sizes)
            levels += [(shared,)] if shared else []
        return Findings(base, nominal, tuple(levels), scores, tuple(sorted(doubtful, key=lambda e: e.error)))

    def worthwhile(self, one: Explanation, parent: Explanation, base: Explanation) -> bool:
        """Whether the last effect of an explanation earns its place."""
        return worthwhile(one, parent, base, self.fitted.joints, self.criteria)

    def second_thoughts(self, base: Explanation) -> tuple[Explanation, ...]:
        """Pairs that begin with an effect which was left behind: alone, each of two may look worse than a third one."""
        found: list[Explanation] = []
        promising = [pair for pair in self.left_behind if pair[1].cost < LEFT * base.fit.cost]
        for candidate, fitted in of_each(promising, RETRIED)[:RETRIED]:
            if any(e.error < self.criteria.far for e in found):
                break
            self.say(f"far from the noise; what if it begins with {candidate.label}?")
            first = self.finish(base, candidate, fitted, RETRIED)
            pairs = [e for e in self.extend(first, base) if self.worthwhile(e, first, base)]
            found += [self.pruned(e) for e in sorted(pairs, key=lambda e: e.error)[:1]]
        return tuple(found)

    def fit_base(self) -> Explanation:
        """Refit what the model already has."""
        self.problem.linearise_starts(self.start)
        first = fit(self.problem, self.start, self.unknowns(self.start), iterations=4)
        self.problem.linearise_starts(first.model)
        second = fit(self.problem, first.model, first.unknowns, iterations=3)
        self.judges.linearise_starts(self.with_known_offsets(second.model))
        judgement = judge(self.judges, self.held_out, self.with_known_offsets(second.model))
        self.offsets = dict(judgement.model.offsets)
        self.say(f"base refitted: held-out error {judgement.error:.2f} x sensor noise")
        return Explanation((), second, judgement, 1.0, 0.0)

    def unknowns(self, model: Model) -> tuple[Unknown, ...]:
        """Everything that a refit of the model may change."""
        sizes = self.shooting.sizes
        return (*base_unknowns(self.fitted, self.start.constants, sizes), *model_unknowns(model, sizes))

    def with_known_offsets(self, model: Model) -> Model:
        """The model with joint offsets for the held-out initialisations too."""
        return Model(model.constants, model.terms, {**self.offsets, **model.offsets})

    def extend(self, parent: Explanation, base: Explanation) -> list[Explanation]:
        """The best ways to add one effect to an explanation."""
        frozen = self.frozen(parent.fit)
        wanted = self.new([*self.candidates, *residual_candidates(self.problem, self.fitted, frozen, self.effects)])
        self.last_scores = screen(self.problem, frozen, wanted)
        chosen = with_groups(self.last_scores, least_gain(parent, base, self.criteria) * frozen.cost)[:REFITTED]
        self.say(f"screened {len(wanted)} candidates, refitting {len(chosen)}")
        raced = of_each(self.race(frozen, chosen), FINALISTS)
        raced = [*(self.restarted(frozen, *pair) for pair in raced[:RESTARTED]), *raced[RESTARTED:]]
        special = [one for pair in raced for one in self.special(frozen, *pair)]
        judged = (*raced, *special)
        return [self.finish(parent, candidate, fitted, len(judged)) for candidate, fitted in judged]

    def new(self, wanted: Sequence[Candidate]) -> list[Candidate]:
        """Without effects that the model to begin with has at that joint already."""
        known = {(term.effect, term.joint) for term in self.start.terms}
        return [one for one in wanted if not any((one.effect, joint) in known for joint in one.joints)]

    def special(self, frozen: Fit, candidate: Candidate, fitted: Fit) -> list[tuple[Candidate, Fit]]:
        """Simpler laws that a fitted profile looks like, fitted, but for those that stay far behind it."""
        wanted = self.new(special_candidates(candidate, fitted.model.terms[-1], self.effects))
        # beside the joint offsets and constants that were fitted together with the profile
        before = replace(fitted.model, terms=fitted.model.terms[:-1])
        tried = [self.refit(frozen, one, LONG, before) for one in wanted]
        self.tell(tried)
        return [pair for pair in tried if pair[1].cost <= FAR_BEHIND * fitted.cost]

    def race(self, frozen: Fit, chosen: Sequence[Candidate]) -> list[tuple[Candidate, Fit]]:
        """Refit briefly, then the leaders at length; those that stay far behind drop out. Best first."""
        brief = sorted((self.refit(frozen, candidate, BRIEF) for candidate in chosen), key=lambda pair: pair[1].cost)
        leaders = [(c, self.continued(frozen, f)) for c, f in of_each(brief, RACED)]
        leaders.sort(key=lambda pair: pair[1].cost)
        self.tell(leaders)
        if not leaders:
            return []
        behind = FAR_BEHIND_AT_FLOOR if self.at_floor(leaders[0][1]) else FAR_BEHIND
        self.last_behind = [pair for pair in leaders if pair[1].cost > behind * leaders[0][1].cost]
        return [pair for pair in leaders if pair[1].cost <= behind * leaders[0][1].cost]

    def restarted(self, frozen: Fit, candidate: Candidate, fitted: Fit) -> tuple[Candidate, Fit]:
        """Far from the floor, a fit from the best of many values around those found, if it comes lower.

        Where a joint sticks and slips the error has more than one valley, and many simulations at once cost little.
        """
        models = [] if self.at_floor(fitted) else other_starts(candidate, fitted.model)
        if not models:
            return candidate, fitted
        costs = [self.problem.cost(self.problem.residual(one)).sum() for one in self.problem.predictions(models)]
        unknowns = fitted.unknowns[len(frozen.unknowns) :]
        nearest = [models[k] for k in np.argsort(costs)[:PROBED]]
        probed = [fit(self.problem, one, unknowns, BRIEF, frozen) for one in nearest]
        best = self.continued(frozen, min(probed, key=lambda one: one.cost))
        if best.cost >= fitted.cost:
            return candidate, fitted
        self.tell([(candidate, best)])
        return candidate, best

    def at_floor(self, fitted: Fit) -> bool:
        """Whether a fit with little free explains nearly everything."""
        return bool(fitted.cost < NEARLY**2 * np.count_nonzero(self.problem.weight))

    def tell(self, refitted: Sequence[tuple[Candidate, Fit]]) -> None:
        """Show the fitted errors in units of the sensor noise."""
        for candidate, fitted in refitted:
            self.say(f"  {np.sqrt(fitted.cost / np.count_nonzero(self.problem.weight)):8.3f}  {candidate.label}")

    def continued(self, frozen: Fit, fitted: Fit) -> Fit:
        """The same fit for longer."""
        return fit(self.problem, fitted.model, fitted.unknowns[len(frozen.unknowns) :], LONG, frozen)

    def frozen(self, fitted: Fit) -> Fit:
        """A fit with its residual and columns taken anew on this problem, to build on."""
        self.problem.linearise_starts(fitted.model)
        prediction, columns = self.problem.columns(fitted.model, fitted.unknowns)
        return renewed(self.problem, fitted, prediction, columns)

    def refit(
        self, frozen: Fit, candidate: Candidate, iterations: int = 6, model: Model | None = None
    ) -> tuple[Candidate, Fit]:
        """Fit a candidate's numbers beside the frozen columns of its parent, started from `model` or the parent's."""
        model, unknowns = candidate.added_to(model or frozen.model)
        return candidate, fit(self.problem, model, unknowns, iterations, frozen=frozen)

    def finish(self, parent: Explanation, candidate: Candidate, refitted: Fit, judged: int) -> Explanation:
        """Fit everything and judge on the held-out trials, of which so many effects are judged."""
        fitted, judgement = self.settled(refitted.model)
        corrected = min(1.0, p_value(parent.judgement, judgement) * judged)
        explanation = Explanation(
            (*parent.effects, candidate), fitted, judgement, corrected, gain(parent.judgement, judgement)
        )
        self.say(f"  held-out error {explanation.error:.3f}  p {corrected:.1e}  {explanation.label}")
        return explanation

    def settled(self, model: Model) -> tuple[Fit, Judgement]:
        """A model with everything refitted, and how it does on the held-out trials."""
        self.problem.linearise_starts(model)
        fitted = fit(self.problem, model, self.unknowns(model), LONG)
        found = self.with_known_offsets(fitted.model)
        self.judges.linearise_starts(found)
        return fitted, judge(self.judges, self.held_out, found)

    def pruned(self, explanation: Explanation) -> Explanation:
        """Without the effects that it does not need: a later one may have done an earlier one's work."""
        for place in range(len(explanation.effects) if len(explanation.effects) > 1 else 0):
            model = without_effect(explanation, place)
            fitted, judgement = self.settled(model)
            if not worse(judgement, explanation.judgement, self.criteria):
                left = explanation.effects[:place] + explanation.effects[place + 1 :]
                self.say(f"  {explanation.effects[place].label} is not needed")
                return self.pruned(replace(explanation, effects=left, fit=fitted, judgement=judgement))
        return explanation


def pursued(better: Sequence[Explanation], criteria: Criteria = STANDARD) -> list[Explanation]:
    """The best, then the simplest that is as good, then the others: what is left may make up for its few numbers."""
    plain = simplest(better, criteria)
    return [better[0], *([] if plain is better[0] else [plain]), *(e for e in better[1:] if e is not plain)]


def without_effect(explanation: Explanation, place: int) -> Model:
    """The fitted model without one of its effects."""
    model = explanation.fit.model
    known = len(model.terms) - explanation.terms
    first = known + sum(len(candidate.joints) for candidate in explanation.effects[:place])
    last = first + len(explanation.effects[place].joints)
    return replace(model, terms=(*model.terms[:first], *model.terms[last:]))


def some(windows: Windows, segments: int) -> Windows:
    """Windows of about so many segments, spread over trials and over the time within trials."""
    by_trial = [np.flatnonzero(windows.trial == k) for k in np.unique(windows.trial)]
    order = [
        int(rows[(turn + k) % len(rows)])
        for turn in range(max(len(rows) for rows in by_trial))
        for k, rows in enumerate(by_trial)
        if turn < len(rows)
    ]
    return windows.take(np.array(sorted(order[: -(-segments // windows.segments)])))
