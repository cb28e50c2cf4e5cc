"""Decide on one of five verdicts from the results of a search and the simulations that it needs."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.resolution import Fitted, final_fit
from tactile_cube.identification.search.evidence import likelihood, standing_out, worse
from tactile_cube.identification.search.explanation import (
    Explanation,
    at_bound,
    complete,
    contains,
    nameable,
    named_by,
    proven,
    simplest,
    sound,
)
from tactile_cube.identification.search.findings import Findings
from tactile_cube.identification.search.residual_shape import Shape, black_box, missing_torques, shapes
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.replay.model import Model

SHOWN_SHAPES = 6
Kind = Literal["adequate", "missing_effect", "ambiguous", "partly_explained", "unknown_effect"]


@dataclass(frozen=True)
class Verdict:
    """Verdict of a diagnosis.

    Attributes:
        kind: see issue and report.
        chosen: the recommended explanation; the base model where nothing is missing or known.
        rivals: explanations that this data cannot distinguish from the chosen one.
    """

    kind: Kind
    chosen: Explanation
    rivals: tuple[Explanation, ...] = ()


def decide(findings: Findings, criteria: Criteria = STANDARD) -> Verdict:
    """Return the verdict on the results of a search."""
    base = findings.base
    found = findings.kept(criteria)
    likely = [one for one in findings.proven(criteria) if not at_bound(one)]
    possible = sound(likely, base, criteria, findings.looked)
    plausible = [one for one in possible if any(one is other for other in found)]
    if not found:
        small = base.largest_error <= criteria.adequate
        return Verdict("adequate", base) if small else Verdict("unknown_effect", closest((), findings, criteria))
    # if none is as good as the best, the best has a parameter at its bound and absorbs what the others lack
    chosen = simplest(plausible or possible, criteria) if possible else base
    if not nameable(chosen, base, criteria):
        return Verdict("unknown_effect", closest(likely if plausible else found, findings, criteria))
    rivals = find_rivals(chosen, possible, criteria)
    if not plausible or not complete(chosen, base, criteria) or lacks_a_law(chosen, found, criteria):
        return Verdict("partly_explained", chosen, rivals)
    return Verdict("ambiguous" if rivals else "missing_effect", chosen, rivals)


def lacks_a_law(chosen: Explanation, found: Sequence[Explanation], criteria: Criteria) -> bool:
    """Return whether a joint's error stays above what is tolerated, while a larger set explains most of it.

    It may do so without proof, in a few segments. A law that differs in form from the machine leaves an error too, but
    no further law explains most of that.
    """
    larger = [one for one in found if named_by(chosen.effects) < named_by(one.effects)]
    left = chosen.largest_error > criteria.tolerated
    return left and any(one.explained(chosen) >= criteria.most for one in larger)


def closest(found: Sequence[Explanation], findings: Findings, criteria: Criteria) -> Explanation:
    """Return the simplest explanation within a standard error of the one that predicts the held-out trials best.

    What is missing is unknown, and effects that stand in for it may do harm in other motion. Source: Breiman, Friedman,
    Olshen, Stone, Classification and regression trees, 1984 (the one-standard-error rule).
    """
    unclear = [one for one in findings.judged if not proven(one, criteria) and not at_bound(one)]
    possible = [findings.base, *found, *unclear]
    best = min(possible, key=lambda one: one.judgement.costs.sum()).judgement
    alike = [one for one in possible if standing_out(likelihood(one.judgement, best), best) <= 1.0]
    return min(alike, key=lambda one: (len(named_by(one.effects)), one.size, one.judgement.costs.sum()))


def find_rivals(
    chosen: Explanation, found: Sequence[Explanation], criteria: Criteria = STANDARD
) -> tuple[Explanation, ...]:
    """Return sets of as few effects and parameters in the band of the chosen one, containing neither it nor a rival."""
    rivals: dict[frozenset[tuple[str, str]], Explanation] = {}
    own = named_by(chosen.effects)
    for other in sorted(found, key=lambda e: e.judgement.costs.sum()):
        names = named_by(other.effects)
        other_law = names != own and len(names) <= len(own) and other.size <= chosen.size + 1
        if other_law and not contains(other, chosen) and not worse(other.judgement, chosen.judgement, criteria):
            rivals.setdefault(names, other)
    return tuple(one for one in rivals.values() if not any(contains(one, other) for other in rivals.values()))


def unexplained_joints(chosen: Explanation, joints: tuple[str, ...], criteria: Criteria = STANDARD) -> list[str]:
    """Return the joints whose held-out error stays above what is tolerated."""
    errors = chosen.judgement.joint_errors
    return [joint for joint, error in zip(joints, errors, strict=True) if error > criteria.tolerated]


@dataclass(frozen=True)
class Unexplained:
    """Unexplained error of a joint.

    Attributes:
        joint: its name.
        shapes: the missing torque over signals, the best explained first.
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


def final_model(search: Search, problem: Problem, model: Model) -> Fitted:
    """Refit a model on all fitted trials, with intervals; keep its values if held-out trials get worse."""
    unknowns = search.unknowns(model)
    found = final_fit(problem, model, unknowns)
    if search.free_runs.worse(found.model, model):
        return final_fit(problem, model, unknowns, iterations=0)
    return found


class Simulations:
    """Cached checks of an explanation beside its fit: final fit and unexplained torque."""

    def __init__(self, search: Search, base: Explanation, floor: NoiseFloor) -> None:
        self.search, self.base, self.floor = search, base, floor
        self.problem = Problem(search.shooting, search.all_windows)
        self._final: dict[str, Fitted] = {}

    def final(self, one: Explanation) -> Fitted:
        """Return the final model of an explanation, see `final_model`."""
        if one.label not in self._final:
            self._final[one.label] = final_model(self.search, self.problem, one.fit.model)
        return self._final[one.label]

    def unexplained(self, one: Explanation, beside_base: bool = False) -> list[Unexplained]:
        """Return the missing torque of each unexplained joint; `beside_base`: also beside the base model.

        Effects that reduce the error without being the cause blur the shape of the missing torque.
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
