"""Effects added one at a time: screen, refit, judge on held-out trials, add, until the floor is reached."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.base import every_effect
from tactile_cube.identification.fitting.error_growth import steady_rows
from tactile_cube.identification.fitting.gauss_newton import Fit, fit
from tactile_cube.identification.fitting.resolution import step_error
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.identification.search.candidates import (
    Candidate,
    apart,
    candidates,
    first_term,
    joined,
    other_starts,
    special_cases,
    with_details,
    without_effect,
)
from tactile_cube.identification.search.division import BRIEF, LONG, SEGMENTS, Division, some
from tactile_cube.identification.search.evidence import gain, p_value
from tactile_cube.identification.search.explanation import (
    Explanation,
    Proposal,
    least_gain,
    needless,
    proven,
    simplest,
    unproven,
    worthwhile,
)
from tactile_cube.identification.search.residual_starts import PROFILE, residual_candidates, special_candidates
from tactile_cube.identification.search.screening import Score, of_each, screen, with_groups
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.nominal import nominal_model

Array = NDArray[np.float64]
REFITTED, RACED, FINALISTS = 14, 6, 4  # candidates that are refitted briefly, at length, and with everything free
RESTARTED, PROBED = 2, 3  # finalists that are tried from other values, and the most promising of these values
FAR_BEHIND = 2.5  # squared error over the best one's at which a refitted candidate is given up
HIDING = 2.0  # times the error of steps that an error may be which they hide
FAR_BEHIND_AT_FLOOR = 2.0  # the same where the best one explains nearly everything
DEEPEST = 3  # effects in combination
BEAM, CLOSE = 2, 1.5  # alternatives that are pursued at each depth, and their squared error over the best one's
Divided = tuple[Recording, Recording]
"""Trials to fit and trials to judge by."""
ENOUGH = 24  # held-out segments at least
FEWEST_ROWS = 8
NEARLY = 1.5  # error over the noise of a fit with little free that explains nearly everything


def enough_rows(held_out: Recording) -> int:
    """Rows of a segment at most, so that the held-out trials have enough of them for a test."""
    rows = sum(np.count_nonzero(trial.valid) for trial in held_out.trials)
    return max(FEWEST_ROWS, int(rows) // ENOUGH)


class Search(Division):
    """A recording with its trials divided, and the effects that may be missing."""

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
        folds: Sequence[Divided] = (),
        longer: int = 1,
        finer: int = 1,
        segments: int = SEGMENTS,
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
            folds: the same trials divided in other ways, for where these few held-out trials do not tell.
            longer: times as long as usual that segments are, and as few, unless small errors grow in them; more than
                once, no sets of effects are looked for, which takes minutes and has been done in the usual ones.
            finer: times as short are the steps of simulation that the sensors call for.
            segments: how many of them to take, of either part.
        """
        start = nominal_model(fitted, known)
        effects = every_effect(effects, start)
        shooting = Shooting(fitted, effects)
        usual = shooting.cut(fitted, noise)
        windows = some(usual if longer == 1 else shooting.cut(fitted, noise, segment=longer * usual.segment), segments)
        segment = min(steady_rows(shooting, start, windows), enough_rows(held_out))
        segments = min(segments, segments * usual.segment // segment)
        super().__init__(shooting, fitted, held_out, noise, segment, known, segments)
        self.say, self.criteria, self.effects, self.folds = say, criteria, effects, folds
        self.sets, self.finer_steps = longer == 1, finer
        self.candidates = candidates(shooting.sizes, effects)
        self.last_scores: list[Score] = []
        self.leaders: list[Proposal] = []

    @cached_property
    def base(self) -> Explanation:
        """Refitted constants alone."""
        return self.fit_base()

    def hidden_by_steps(self, one: Explanation) -> bool:
        """Whether what an explanation leaves may be the error of its steps of simulation."""
        if self.finer_steps == 1:
            return False
        steps = step_error(self.fitted, self.shooting, one.fit.model, self.noise, self.finer_steps)
        return bool(one.error < np.hypot(1.0, HIDING * steps))

    def fold_divisions(self) -> list[Division]:
        """The same trials divided in the other ways."""
        return [
            Division(self.shooting, fitted, held_out, self.noise, self.segment, self.known, self.segments)
            for fitted, held_out in self.folds
        ]

    def one_by_one(
        self, base: Explanation, standard: tuple[Explanation, ...] = ()
    ) -> tuple[list[tuple[Explanation, ...]], tuple[Score, ...], list[Explanation]]:
        """Effects added one at a time: levels of explanations, the first look, and what may be chance at the end.

        They are added to the base model, and to the first of `standard`, what of the standard model is stated wrongly,
        unless that leaves nothing: then only single effects that do as well are of interest.
        """
        levels: list[tuple[Explanation, ...]] = [standard] if standard else []
        scores: tuple[Score, ...] = ()
        beam = (*(e for e in standard[:1] if e.largest_error > self.criteria.floor), base)
        while len(levels) < DEEPEST and not any(e.largest_error <= self.criteria.floor for e in beam):
            found = [(parent, e) for parent in beam for e in self.extend(parent, base)]
            scores = scores or tuple(self.last_scores)
            better = [e for parent, e in found if self.worthwhile(e, parent, base)] or self.in_pairs(found, base)
            if not better:
                return levels, scores, [e for parent, e in found if unproven(e, parent, self.criteria)]
            better.sort(key=lambda e: e.judgement.costs.sum())
            better[0] = self.pruned(better[0])
            levels.append(tuple(better))
            least = better[0].judgement.costs.sum()
            beam = tuple(e for e in pursued(better, self.criteria)[:BEAM] if e.judgement.costs.sum() < CLOSE * least)
        return levels, scores, []

    def in_pairs(self, found: Sequence[tuple[Explanation, Explanation]], base: Explanation) -> list[Explanation]:
        """Two effects more that earn their place together, where the first of them is proven and does not alone."""
        first = [
            (parent, one)
            for parent, one in found
            if parent.effects and one.gain > self.criteria.large_gain and proven(one, parent, self.criteria)
        ]
        pairs = []
        for parent, one in sorted(first, key=lambda pair: pair[1].judgement.costs.sum())[:BEAM]:
            for two in self.extend(one, base):
                both = gain(parent.judgement, two.judgement)
                together = replace(two, gain=both, p_value=max(one.p_value, two.p_value))
                if two.gain > self.criteria.least_gain and self.worthwhile(together, parent, base):
                    pairs.append(together)
        return pairs

    def worthwhile(self, one: Explanation, parent: Explanation, base: Explanation) -> bool:
        """Whether the last effect of an explanation earns its place."""
        return worthwhile(one, parent, base, self.fitted.joints, self.criteria)

    def extend(self, parent: Explanation, base: Explanation) -> list[Explanation]:
        """The best ways to add one effect to an explanation."""
        frozen, raced = self.raced(parent, base)
        raced = of_each(raced, FINALISTS)
        raced = [*(self.restarted(frozen, *pair) for pair in raced[:RESTARTED]), *raced[RESTARTED:]]
        special = [one for pair in raced for one in self.special(frozen, *pair)]
        judged = (*raced, *special)
        return [self.finish(parent, candidate, fitted, len(judged)) for candidate, fitted in judged]

    def raced(self, parent: Explanation, base: Explanation) -> tuple[Fit, list[tuple[Candidate, Fit]]]:
        """An explanation's fit, and what follows the data best beside it, best first."""
        frozen = self.frozen(parent.fit)
        self.last_scores = screen(self.problem, frozen, self.wanted(frozen))
        chosen = with_groups(self.last_scores, least_gain(parent, base, self.criteria) * frozen.cost)[:REFITTED]
        self.say(f"screened {len(self.last_scores)} candidates, refitting {len(chosen)}")
        return frozen, self.race(frozen, self.brief(frozen, chosen))

    def wanted(self, frozen: Fit) -> list[Candidate]:
        """Return what may be added to a fit: at starts of its own, or read from what the fit leaves."""
        return self.new([*self.candidates, *residual_candidates(self.problem, self.fitted, frozen, self.effects)])

    def new(self, wanted: Sequence[Candidate]) -> list[Candidate]:
        """Without effects that the model to begin with has at that joint already."""
        known = {(term.effect, term.joint) for term in self.start.terms}
        return [one for one in wanted if not any((one.effect, joint) in known for joint in one.joints)]

    def and_richer(self, frozen: Fit, fitted: Sequence[tuple[Candidate, Fit]]) -> list[tuple[Candidate, Fit]]:
        """Laws, and those with the details of their law, fitted from there, that follow the data clearly better."""
        found = list(fitted)
        for candidate, plain in fitted:
            if richer := with_details(candidate, plain.model):
                detailed, model, unknowns = richer
                tried = fit(self.problem, model, unknowns, LONG, frozen)
                found += [(detailed, tried)] if tried.cost < (1.0 - self.criteria.least_gain) * plain.cost else []
        return found

    def special(self, frozen: Fit, candidate: Candidate, fitted: Fit) -> list[tuple[Candidate, Fit]]:
        """Simpler laws that a fitted profile looks like, fitted, but for those that stay far behind it."""
        wanted = self.new(special_candidates(candidate, fitted.model.terms[-1], self.effects))
        # beside the joint offsets and constants that were fitted together with the profile
        before = replace(fitted.model, terms=fitted.model.terms[:-1])
        tried = self.and_richer(frozen, [self.refit(frozen, one, LONG, before) for one in wanted])
        self.tell(tried)
        return [pair for pair in tried if pair[1].cost <= FAR_BEHIND * fitted.cost]

    def brief(self, frozen: Fit, chosen: Sequence[Candidate]) -> list[tuple[Candidate, Fit]]:
        """Brief refits, best first."""
        return sorted((self.refit(frozen, candidate, BRIEF) for candidate in chosen), key=lambda pair: pair[1].cost)

    def race(self, frozen: Fit, brief: Sequence[tuple[Candidate, Fit]]) -> list[tuple[Candidate, Fit]]:
        """The leaders of brief refits, best first, at length; those that stay far behind drop out."""
        leaders = self.and_richer(frozen, [(c, self.continued(frozen, f)) for c, f in of_each(brief, RACED)])
        leaders.sort(key=lambda pair: pair[1].cost)
        self.tell(leaders)
        if not leaders:
            return []
        self.leaders = self.leaders or [Proposal((c,), f) for c, f in leaders]
        behind = FAR_BEHIND_AT_FLOOR if self.at_floor(leaders[0][1]) else FAR_BEHIND
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
            self.say(f"  {self.over_noise(fitted):8.3f}  {candidate.label}")

    def finish(self, parent: Explanation, candidate: Candidate, refitted: Fit, judged: int) -> Explanation:
        """Fit everything and judge on the held-out trials, of which so many effects are judged."""
        return self.explanation(parent, (*parent.effects, candidate), refitted.model, judged)

    def explanation(
        self, parent: Explanation, effects: tuple[Candidate, ...], model: Model, judged: int
    ) -> Explanation:
        """A model with these effects, everything refitted, beside what it is to be better than."""
        fitted, judgement = self.settled(model)
        corrected = min(1.0, p_value(parent.judgement, judgement) * judged)
        explanation = Explanation(effects, fitted, judgement, corrected, gain(parent.judgement, judgement))
        self.say(f"  held-out error {explanation.error:.3f}  p {corrected:.1e}  {explanation.label}")
        return explanation

    def pruned(self, explanation: Explanation) -> Explanation:
        """Without the effects that it does not need, none richer or at more joints than it has to be.

        A later one may have done an earlier one's work, or what an earlier one's law was bent to.
        """
        whole = replace(explanation, effects=apart(explanation.effects))
        pruned = self.each_pruned(whole, whole)
        return replace(pruned, effects=joined(pruned.effects))

    def each_pruned(self, explanation: Explanation, whole: Explanation) -> Explanation:
        """The same where every effect is at a single joint; what went before counts in what the `whole` does better."""
        for said, effects, model in self.simpler(explanation):
            fitted, judgement = self.settled(model)
            removed = [one for one in whole.effects if one not in effects]
            if needless(whole.judgement, judgement, self.fitted.joints, removed, self.criteria):
                self.say(f"  {said}")
                return self.each_pruned(replace(explanation, effects=effects, fit=fitted, judgement=judgement), whole)
        return explanation

    def simpler(self, explanation: Explanation) -> Iterator[tuple[str, tuple[Candidate, ...], Model]]:
        """What may do for an explanation: in words, the effects, and the fitted model with them."""
        model, effects = explanation.fit.model, explanation.effects
        for place, effect in enumerate(effects):
            if len(effects) > 1:
                left = effects[:place] + effects[place + 1 :]
                yield f"{effect.label} is not needed", left, without_effect(model, effects, place)
                for other, changed in self.special_cases(model, effects, place):
                    yield f"{other[place].label} does for {effect.label}", other, changed

    def special_cases(
        self, model: Model, effects: tuple[Candidate, ...], place: int
    ) -> Iterator[tuple[tuple[Candidate, ...], Model]]:
        """Sets, and their models, with a special case of an effect's law in its place, at its start.

        In the place of a fitted profile only what it looks like.
        """
        known: Sequence[Candidate] = self.candidates
        if PROFILE in effects[place].form:
            known = special_candidates(effects[place], model.terms[first_term(model, effects, place)], self.effects)
        return special_cases(model, effects, place, self.new(known))


def pursued(better: Sequence[Explanation], criteria: Criteria = STANDARD) -> list[Explanation]:
    """The best, then the simplest that is as good, then the others: what is left may make up for its few numbers."""
    plain = simplest(better, criteria)
    return [better[0], *([] if plain is better[0] else [plain]), *(e for e in better[1:] if e is not plain)]
