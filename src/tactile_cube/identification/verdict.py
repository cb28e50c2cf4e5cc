"""From everything that was tried to an answer: one of five verdicts, and the simulations that it asks for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from tactile_cube.drivetrain.effects.effect import Stage
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.intervals import Fitted, final_fit
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.search.evidence import gain, p_value, worse
from tactile_cube.identification.search.explanation import Explanation, contains, named, simplest
from tactile_cube.identification.search.findings import Findings
from tactile_cube.identification.search.residual_shape import Shape, black_box, missing_torques, shapes
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.comparing.error import free_run_error
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.replay.simulator import Engine, free_run

SHOWN_SHAPES = 6
Kind = Literal["adequate", "missing_effect", "ambiguous", "partly_explained", "unknown_effect"]


@dataclass(frozen=True)
class Verdict:
    """The answer.

    Attributes:
        kind: see issue and report.
        chosen: the recommended explanation; the base model where nothing is missing or known.
        rivals: explanations that this data cannot tell from the chosen one.
    """

    kind: Kind
    chosen: Explanation
    rivals: tuple[Explanation, ...] = ()


def decide(findings: Findings, ask: Simulations, criteria: Criteria = STANDARD) -> Verdict:
    """The answer to what a search has found."""
    base = findings.base
    if not findings.levels:
        return Verdict("adequate" if base.largest_error <= criteria.adequate else "unknown_effect", base)
    found = [one for level in findings.levels for one in level]
    plausible, chosen = [one for one in found if not at_bound(one)], simplest(found, criteria)
    if at_bound(chosen):
        as_good = [one for one in plausible if not worse(one.judgement, chosen.judgement, criteria)]
        if not as_good:
            return _but_for_the_implausible(chosen, plausible, findings, criteria)
        chosen = simplest(as_good, criteria)
    chosen = next((one for one in plausible if contains(chosen, one) and ask.alike(chosen, one)), chosen)
    whole = _explains(chosen, base, ask, criteria) and not ask.follows_signals(chosen)
    if not whole and chosen.explained(base) < criteria.most and not ask.as_repeats(chosen):
        return Verdict("unknown_effect", closest(plausible, findings))
    rivals = find_rivals(chosen, plausible, ask, criteria)
    if not whole:
        return Verdict("partly_explained", chosen, rivals)
    return Verdict("ambiguous" if rivals else "missing_effect", chosen, rivals)


def _but_for_the_implausible(
    chosen: Explanation, plausible: Sequence[Explanation], findings: Findings, criteria: Criteria
) -> Verdict:
    """What is left to say where the best explanation stands in for another law: its plausible part, if that is most."""
    part = [one for one in plausible if named(one) < named(chosen) and one.explained(findings.base) > criteria.most]
    if part:
        return Verdict("partly_explained", simplest(part, criteria))
    return Verdict("unknown_effect", closest(plausible or [chosen], findings))


def closest(found: Sequence[Explanation], findings: Findings) -> Explanation:
    """The explanation that follows the held-out trials best: where none is claimed, a model is there to predict."""
    possible = [*found, *(one for one in findings.unclear if not at_bound(one))]
    return min(possible, key=lambda one: one.judgement.costs.sum())


def _explains(chosen: Explanation, base: Explanation, ask: Simulations, criteria: Criteria) -> bool:
    """Whether an explanation is the whole of it.

    One effect may leave more than is tolerated: real laws differ in detail from those of the catalogue. Where several
    leave it, the last of them may follow a detail of the first. What is left at other joints is no such thing.
    """
    share = chosen.explained(base)
    if chosen.error > criteria.adequate and share < criteria.most:
        return False
    if chosen.error <= criteria.tolerated:
        return True
    detail = chosen.error < criteria.far and len({effect for effect, _ in named(chosen)}) == 1
    detail = detail and not ask.leaves_elsewhere(chosen)
    return share > criteria.nearly_whole and (detail or ask.as_repeats(chosen))


def at_bound(one: Explanation) -> bool:
    """Whether a number of its effects ends at the edge of what such a number may be.

    Then the law stands in for another one: so do waves longer than the range of motion for any bent curve.
    """
    model = one.fit.model
    return any(
        math.isclose(unknown.of(model), edge, rel_tol=1e-6) and edge != unknown.neutral
        for unknown in one.fit.unknowns
        if unknown.kind == "effect" and unknown.place >= len(model.terms) - one.terms
        for edge in (unknown.low, unknown.high)
    )


def find_rivals(
    chosen: Explanation, found: Sequence[Explanation], ask: Simulations, criteria: Criteria = STANDARD
) -> tuple[Explanation, ...]:
    """Explanations by as many other effects that are as good: with at most a number more, or else clearly better.

    Of laws that contain the chosen one only those that are clearly better, and not alike in practice: they always
    follow data as well. Of other laws with as few numbers those too that are alike in practice: what tells them apart
    is less than a law differs from the real thing in detail, however significant. A rival that is another one in
    practice is none of its own.
    """
    rivals: dict[frozenset[tuple[str, str]], Explanation] = {}
    for other in sorted(found, key=lambda e: e.judgement.costs.sum()):
        if len(named(other)) > len(named(chosen)) or named(other) == named(chosen):
            continue
        if contains(other, chosen):
            rival = _richer_earned(other, chosen, criteria) and not ask.alike(other, chosen)
        else:
            simple = other.size <= chosen.size + 1 or _richer_earned(other, chosen, criteria)
            rival = simple and not worse(other.judgement, chosen.judgement, criteria)
            rival = rival or (_may_be_alike(other, chosen, criteria) and ask.alike(other, chosen))
        if rival:
            rivals.setdefault(named(other), other)
    different = rivals.values()
    return tuple(r for r in different if not any(contains(r, other) and ask.alike(r, other) for other in different))


def _may_be_alike(other: Explanation, chosen: Explanation, criteria: Criteria) -> bool:
    """Whether another law, no richer and no special case, may predict the same: errors differ by no more than that."""
    close = abs(other.error - chosen.error) <= criteria.alike
    return close and other.size <= chosen.size and not contains(chosen, other)


def _richer_earned(other: Explanation, chosen: Explanation, criteria: Criteria) -> bool:
    """Whether more numbers than the chosen one has pay: a law that contains another always fits a little better."""
    better = gain(chosen.judgement, other.judgement) > criteria.least_gain
    return better and p_value(chosen.judgement, other.judgement) < criteria.likely


def unexplained_joints(chosen: Explanation, joints: tuple[str, ...], criteria: Criteria = STANDARD) -> list[str]:
    """Joints whose held-out error stays above what is tolerated."""
    errors = chosen.judgement.joint_errors
    return [joint for joint, error in zip(joints, errors, strict=True) if error > criteria.tolerated]


@dataclass(frozen=True)
class Unexplained:
    """What is left at a joint.

    Attributes:
        joint: its name.
        shapes: the missing torque over signals, most telling first.
        black_box: share of the rest that a black box could still explain beside the recommended model.
        explained: share of the torque missing beside the base model that the recommended model accounts for.
    """

    joint: str
    shapes: list[Shape] = field(repr=False)
    black_box: float
    explained: float = 0.0

    @property
    def of_explainable(self) -> float:
        """Share that the effects explain of what they and a black box explain together."""
        together = self.explained + (1.0 - self.explained) * self.black_box
        return self.explained / together if together > 0.0 else 0.0


class Simulations:
    """What a decision asks of an explanation beside its fit: simulated where it matters, each question once."""

    def __init__(self, search: Search, base: Explanation, floor: NoiseFloor, engine: Engine, step: float) -> None:
        self.search, self.base, self.floor, self.engine, self.step = search, base, floor, engine, step
        self.problem = Problem(search.shooting, search.all_windows)
        self._final: dict[str, Fitted] = {}
        self._errors: dict[str, dict[str, float]] = {}

    def as_repeats(self, one: Explanation) -> bool:
        """Whether its free run is hardly further from the held-out trials than the machine is from itself in repeats.

        At every joint: one that hardly repeats itself says nothing of the others. Where a machine can tip over, a few
        segments are far off all the same; and one that does not repeat itself is further from any model than its
        sensor's noise.
        """
        most = self.search.criteria.adequate
        return self.floor.source == "repeats" and all(
            error <= most * self.floor.joints[joint] for joint, error in self.free_errors(one).items()
        )

    def leaves_elsewhere(self, one: Explanation) -> bool:
        """Whether much is left at joints where its last effect does not act; one of the mechanism acts at all."""
        last, joints = one.effects[-1], self.search.fitted.joints
        poor = set(unexplained_joints(one, joints, self.search.criteria))
        return last.effect.stage is not Stage.MECHANISM and not poor <= set(last.joints)

    def follows_signals(self, one: Explanation) -> bool:
        """Whether what it leaves is a function of the logged signals, and so no noise: what was named is not all."""
        return any(left.black_box > self.search.criteria.large_gain for left in self.unexplained(one))

    def alike(self, one: Explanation, other: Explanation) -> bool:
        """Whether the two predict the held-out trials so much alike that they are one law in practice."""
        validation = self.search.validation
        first, second = validation.predictions([one.judgement.model, other.judgement.model])
        difference = validation.limited(first - second) * validation.weight
        return bool(np.mean(difference[validation.weight > 0.0] ** 2) < self.search.criteria.alike**2)

    def final(self, one: Explanation) -> Fitted:
        """An explanation with intervals, refitted on all fitted trials unless held-out ones are followed worse then."""
        if one.label not in self._final:
            unknowns = self.search.unknowns(one.fit.model)
            found = final_fit(self.problem, one.fit.model, unknowns)
            if self.search.free_runs.worse(found.model, one.fit.model):
                found = final_fit(self.problem, one.fit.model, unknowns, iterations=0)
            self._final[one.label] = found
        return self._final[one.label]

    def free_errors(self, one: Explanation) -> dict[str, float]:
        """Error of its free run on the held-out trials, joint by joint [rad]."""
        if one.label not in self._errors:
            model, held_out = self.final(one).model.with_offsets(one.judgement.model.offsets), self.search.held_out
            simulated = free_run(held_out, model, self.engine, self.step)
            self._errors[one.label] = free_run_error(held_out, simulated).joints
        return self._errors[one.label]

    def unexplained(self, one: Explanation, beside_base: bool = False) -> list[Unexplained]:
        """What is left at each joint that is not explained; `beside_base`, also beside the base model.

        Effects that help and are not the cause blur the shape of what is missing.
        """
        search, found = self.search, list[Unexplained]()
        joints = unexplained_joints(one, search.fitted.joints, search.criteria)
        if not joints:
            return found
        beside = {"the recommended model": one.judgement, "the model with refitted constants": self.base.judgement}
        missing = {
            name: missing_torques(search.validation, search.held_out, judged.model, judged.residual)
            for name, judged in beside.items()
        }
        recommended, base = missing.values()
        for j, joint in enumerate(search.fitted.joints):
            if joint in joints:
                shown = missing.items() if beside_base else [*missing.items()][:1]
                curves = [[replace(one, beside=name) for one in shapes(torques[j])] for name, torques in shown]
                clearest = max(curves, key=lambda curve: curve[0].explained)
                explained = 1.0 - recommended[j].torque.var() / max(base[j].torque.var(), 1e-30)
                left = black_box(recommended[j])
                found.append(Unexplained(joint, clearest[:SHOWN_SHAPES], left, max(0.0, float(explained))))
        return found
