"""The search from everything at once, with fits and held-out costs that are made up; the standard model."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.search.candidates import Candidate, forms, special_cases
from tactile_cube.identification.search.evidence import Judgement, all_of
from tactile_cube.identification.search.explanation import Explanation, Proposal
from tactile_cube.identification.search.residual_shape import Motion
from tactile_cube.identification.search.screening import Columns, Score, best_subsets, possible
from tactile_cube.identification.search.together import Together, regressed
from tactile_cube.measurement.replay.model import Model, Term
from tests.identification.test_verdict import FIT, MODEL, judged


def candidate(name: str) -> Candidate:
    effect = find_effect(name)
    return Candidate(effect, ("q1",), forms(effect)[0])


def columns(names: list[str], gradient: list[float], gram: list[list[float]]) -> Columns:
    scores = [Score(candidate(name), 0.0, 1.0) for name in names]
    return Columns(scores, np.array(gradient), np.array(gram))


def test_two_effects_that_help_only_together_are_the_best_pair() -> None:
    # the residual is the small difference of two large columns: each alone is nearly at right angles to it
    names = ["viscous_friction", "reflected_inertia", "torque_bias"]
    first, second, third = np.array([1.0, 0.0, 0.0]), np.array([-0.98, 0.2, 0.0]), np.array([0.0, 0.3, 1.0])
    residual, stacked = np.array([0.02, 0.2, 0.0]), np.stack([first, second, third])
    looked_at = columns(names, list(stacked @ residual), (stacked @ stacked.T).tolist())
    (single, _), (together, pair) = best_subsets(looked_at, 1)[0], best_subsets(looked_at, 2)[0]
    assert single < 0.5 * together
    assert {one.effect.name for one in pair} == {"viscous_friction", "reflected_inertia"}
    assert together == pytest.approx(float(residual @ residual), rel=1e-6)


def test_a_friction_that_would_have_to_drive_the_joint_is_in_no_set() -> None:
    names = ["coulomb_friction", "torque_gain"]
    found = best_subsets(columns(names, [-3.0, -2.0], [[10.0, 0.0], [0.0, 10.0]]), 1)
    assert [one.effect.name for _, (one,) in found] == ["torque_gain"]
    assert not possible(candidate("coulomb_friction"), -0.5)
    assert possible(candidate("torque_gain"), -0.5)


ERRORS = {
    frozenset(): 20.0,
    frozenset({"viscous_friction"}): 15.0,
    frozenset({"position_torque"}): 19.0,
    frozenset({"viscous_friction", "position_torque"}): 5.0,
    frozenset({"viscous_friction", "position_torque", "cogging"}): 4.999,
}


class MadeUp:
    """A division of the trials in which the error follows from the names of a model's effects."""

    offsets: dict[int, np.ndarray] = {}  # noqa: RUF012
    fitted = SimpleNamespace(joints=("q1",))

    def __init__(self, seed: int = 0, chance: bool = False) -> None:
        self.seed, self.chance, self.candidates = seed, chance, []
        self.criteria, self.said = STANDARD, []
        self.say = self.said.append
        self.special_cases = lambda model, effects, place: special_cases(model, effects, place, self.candidates)
        self.worthwhile = lambda one, *_: one.p_value < STANDARD.significant_if_large

    def refitted(self, model: Model) -> object:
        return replace(FIT, model=model, cost=ERRORS.get(names(model), 20.0) ** 2)

    def judged(self, model: Model) -> Judgement:
        if not self.chance:
            return judged(ERRORS.get(names(model), 20.0), self.seed)
        return judged(20.0, self.seed + 10 * len(model.terms))

    def settled(self, model: Model) -> tuple[object, Judgement]:
        return self.refitted(model), self.judged(model)

    def fit_base(self) -> Explanation:
        return Explanation((), replace(FIT, cost=400.0), self.judged(MODEL), 1.0, 0.0)


def names(model: Model) -> frozenset[str]:
    return frozenset(term.effect.name for term in model.terms)


class Proposed(Together):
    """With proposals as given."""

    def proposals(self, leaders: object) -> list[Proposal]:
        effects = tuple(candidate(name) for name in ("viscous_friction", "cogging", "position_torque"))
        terms = tuple(Term(one.effect, "q1", dict(one.form), tuple(one.form)) for one in effects)
        model = Model({}, terms, {})
        return [Proposal(effects, replace(FIT, model=model, cost=ERRORS.get(names(model), 20.0) ** 2))]


def found(search: MadeUp, folds: list[MadeUp]) -> tuple[Explanation, ...]:
    base = search.fit_base()
    return Proposed(search, base, folds).run([], base)[0]  # type: ignore[arg-type]


def test_a_set_is_pruned_of_what_the_held_out_trials_do_not_ask_for() -> None:
    (one,) = found(MadeUp(), [])
    assert [c.effect.name for c in one.effects] == ["viscous_friction", "position_torque"]
    assert one.gain == pytest.approx(1.0 - 25.0 / 400.0, rel=1e-6)


def test_a_set_that_chance_makes_is_no_answer() -> None:
    assert found(MadeUp(chance=True), []) == ()


def test_where_segments_are_few_all_parts_of_the_trials_judge() -> None:
    search, folds = MadeUp(), [MadeUp(1), MadeUp(2)]
    assert len(Proposed(search, search.fit_base(), folds).base_evidence.costs) == 60, "60 segments are enough"
    few = replace(search.fit_base().judgement, samples=np.where(np.arange(60) < 17, 100, 0))
    base = replace(search.fit_base(), judgement=few)
    assert len(Proposed(search, base, folds).base_evidence.costs) == 180  # type: ignore[arg-type]


def test_parts_that_judge_together_keep_their_trials_apart() -> None:
    both = all_of([judged(2.0), judged(4.0, 1)])
    assert both.error == pytest.approx(np.sqrt(10.0), rel=1e-6)
    assert len(np.unique(both.trial)) == 12
    assert both.joint_errors[0] == pytest.approx(np.sqrt(10.0))


def test_a_set_in_the_price_of_which_each_number_counts() -> None:
    plain, rich = candidate("coulomb_friction"), candidate("position_torque")
    one = Proposal((plain,), SimpleNamespace(cost=100.0))  # type: ignore[arg-type]
    assert one.price(STANDARD) == pytest.approx(100.0 / 0.96)
    two = Proposal((plain, rich), SimpleNamespace(cost=97.0))  # type: ignore[arg-type]
    assert two.price(STANDARD) > one.price(STANDARD)


RNG = np.random.default_rng(0)


def made_up(speed: np.ndarray, lacking: np.ndarray) -> Motion:
    """A log of joints that move at such speeds (samples, n), whose drives give what the motion takes and so much."""
    taken = 30.0 * RNG.normal(size=speed.shape)
    return Motion(speed, np.sign(speed), RNG.normal(size=speed.shape), taken + lacking, taken)


def test_friction_by_direction_inertia_offset_and_gain_come_back_from_the_log() -> None:
    v = RNG.normal(size=(5000, 1))
    motion = made_up(v, 20.4 * np.sign(v) + np.where(v > 0, 167.0, 240.0) * v + 3.2 + RNG.normal(size=v.shape))
    motion = replace(motion, drive=(motion.drive + 12.0 * motion.acceleration) / 1.05)
    found = regressed(motion, 0)
    assert set(found) == {"coulomb_friction", "viscous_friction", "torque_bias", "reflected_inertia", "torque_gain"}
    assert found["coulomb_friction"]["friction"] == pytest.approx(20.4, rel=0.01)
    assert found["viscous_friction"]["damping"] == pytest.approx(0.5 * (167.0 + 240.0), rel=0.01)
    assert found["viscous_friction"]["difference"] == pytest.approx(167.0 - 240.0, rel=0.02)
    assert found["torque_bias"]["bias"] == pytest.approx(-3.2, rel=0.05)
    assert found["reflected_inertia"]["excess"] == pytest.approx(12.0, rel=0.01)
    assert found["torque_gain"]["error"] == pytest.approx(0.05, rel=0.05)


def test_what_a_drive_does_not_need_is_no_law_of_it() -> None:
    v = RNG.normal(size=(5000, 3))
    coupled = 2.0 * v[:, 1] + 2.4 * np.sign(v[:, 2]) + 0.9 * v[:, 2] + 0.1 * RNG.normal(size=5000)
    motion = made_up(
        v, np.stack([RNG.normal(size=5000), coupled, 5.0 * np.sign(v[:, 2]) + RNG.normal(size=5000)], axis=1)
    )
    assert regressed(motion, 0) == {}
    found = regressed(motion, 1)
    assert set(found) == {"viscous_friction", "joint_coupling"}
    assert found["joint_coupling"] == pytest.approx({"damping_next": -0.9, "friction_next": -2.4}, rel=0.05)
    assert regressed(motion, 2) == {"coulomb_friction": {"friction": pytest.approx(5.0, rel=0.01)}}
