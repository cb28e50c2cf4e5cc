from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.search import search as module
from tactile_cube.identification.search.candidates import Candidate, forms
from tactile_cube.identification.search.evidence import Judgement, p_value
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.screening import Score, of_each, with_groups
from tactile_cube.identification.search.search import Search, pursued
from tests.identification.test_verdict import JOINTS, explanation, findings, judged

FIT = SimpleNamespace(cost=0.0, model=None)  # stands for a fit: the choice goes by order alone


@pytest.mark.parametrize(
    ("order", "count", "chosen"),
    [("aaabbcd", 3, "aabc"), ("aaab", 3, "aaab"), ("abcd", 2, "abc"), ("aabbb", 1, "aa")],
)
def test_no_effect_is_crowded_out_by_variants_of_another(order: str, count: int, chosen: str) -> None:
    effects = dict(zip("abcd", ("torque_bias", "cogging", "backlash", "joint_stop"), strict=True))
    letter = {name: key for key, name in effects.items()}
    pairs = [(Candidate(e, (f"q{k}",), forms(e)[0]), FIT) for k, e in enumerate(find_effect(effects[x]) for x in order)]
    kept = of_each(pairs, count)  # type: ignore[arg-type]
    assert "".join(letter[candidate.effect.name] for candidate, _ in kept) == chosen
    assert [c.joints for c, _ in kept] == sorted(c.joints for c, _ in kept)


def test_the_simplest_of_equals_is_pursued_beside_the_best() -> None:
    profile, bias = explanation("position_torque", 6.000), explanation("torque_bias", 6.001)
    curved, poor = explanation("stribeck_friction", 6.0005), explanation("payload", 9.0)
    order = [one.effects[0].effect.name for one in pursued([profile, curved, bias, poor])]
    assert order == ["position_torque", "torque_bias", "stribeck_friction", "payload"]
    assert [one.error for one in pursued([bias, profile])] == [bias.error, profile.error], "the best may be simplest"


def score(name: str, joint: str, gain: float) -> Score:
    effect = find_effect(name)
    return Score(Candidate(effect, (joint,), forms(effect)[0]), gain, 1.0)


def test_where_a_first_look_promises_next_to_nothing_nothing_is_refitted() -> None:
    scores = [score("cogging", "q1", 30.0), score("backlash", "q1", 20.0), score("payload", "q2", 0.5)]
    assert [c.effect.name for c in with_groups(scores, 100.0)] == ["cogging", "backlash"]
    assert with_groups(scores, 400.0) == []
    together = [score("cogging", "q1", 80.0), score("cogging", "q2", 70.0)]
    assert with_groups(together, 400.0)[0].joints == ("q1", "q2"), "at all joints together it promises enough"


class Contest(Search):
    """A search in which given effects come through to the held-out trials, and all do equally well there."""

    def __init__(self, names: list[str], outcome: Judgement) -> None:
        self.finalists = [(explanation(name, 1.0).effects[0], FIT) for name in names]
        self.outcome, self.candidates, self.effects = outcome, [], ()  # type: ignore[assignment]
        self.problem = self.fitted = self.start = SimpleNamespace(terms=())  # type: ignore[assignment]
        self.say = lambda line: None

    def frozen(self, fitted: object) -> object:  # type: ignore[override]
        return SimpleNamespace(cost=1.0)

    def race(self, frozen: object, chosen: object) -> list:  # type: ignore[override, type-arg]
        return self.finalists

    def restarted(self, frozen: object, *pair: object) -> tuple[object, ...]:  # type: ignore[override]
        return pair

    def special(self, frozen: object, *pair: object) -> list:  # type: ignore[override, type-arg]
        return []

    def settled(self, model: object) -> tuple[object, Judgement]:  # type: ignore[override]
        return FIT, self.outcome


@pytest.mark.parametrize("names", [["cogging"], ["cogging", "backlash", "payload", "torque_bias"]])
def test_the_more_effects_are_judged_beside_it_the_less_significant_is_each(
    names: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for stage in ("residual_candidates", "screen"):
        monkeypatch.setattr(module, stage, lambda *_: [])
    base = findings(1.3).base
    after = judged(1.28, seed=1)  # a gain that chance may well give
    alone = p_value(base.judgement, after)
    assert 0.01 < alone < 0.25, "so that four times it is no probability above one"
    found = Contest(names, after).extend(base, base)
    assert [one.p_value for one in found] == pytest.approx([len(names) * alone] * len(names))


class OneOfThree(Search):
    """A search whose base is at the noise over three joints together, and that finds what is missing at the first."""

    def __init__(self, first_joint: float) -> None:
        self.say = lambda line: None
        self.last_scores = []
        start = findings(1.05).base
        self.base = replace(start, judgement=replace(start.judgement, joint_errors=np.array([first_joint, 1.0, 1.0])))

    def extend(self, parent: Explanation, base: Explanation) -> list[Explanation]:
        return [explanation("actuator_lag", 0.99, base=1.05)]

    def worthwhile(self, one: Explanation, parent: Explanation, base: Explanation) -> bool:
        return True

    def pruned(self, explanation: Explanation) -> Explanation:
        return explanation


@pytest.mark.parametrize(("first_joint", "levels"), [(1.24, 1), (1.08, 0)])
def test_the_noise_is_asked_of_each_joint(first_joint: float, levels: int) -> None:
    search = OneOfThree(first_joint)
    assert search.base.error < STANDARD.floor
    assert len(search.one_by_one(search.base)[0]) == levels


@pytest.mark.parametrize(("finer", "error", "hidden"), [(8, 4.1, True), (8, 9.0, False), (1, 4.1, False)])
def test_an_error_of_the_size_of_the_steps_own_is_hidden_by_them(
    monkeypatch: pytest.MonkeyPatch, finer: int, error: float, hidden: bool
) -> None:
    monkeypatch.setattr(module, "step_error", lambda recording, shooting, model, noise, times: 3.0)
    asked: Any = SimpleNamespace(finer_steps=finer, fitted=None, shooting=None, noise=None)
    one: Any = SimpleNamespace(error=error, fit=SimpleNamespace(model=None))
    assert Search.hidden_by_steps(asked, one) is hidden


class OneAfterAnother(Search):
    """A search in which a delay explains half of what friction leaves, and play all but `last` of the rest."""

    def __init__(self, last: float) -> None:
        self.say, self.last_scores, self.last = lambda line: None, [], last
        self.base = findings(20.0).base
        self.fitted: Any = SimpleNamespace(joints=JOINTS)

    def extend(self, parent: Explanation, base: Explanation) -> list[Explanation]:
        chain = [("stribeck_friction", 5.0), ("command_delay", 3.5), ("backlash", self.last), ("payload", self.last)]
        name, error = chain[len(parent.effects)]
        one = explanation(name, error, parent.error)
        return [replace(one, effects=(*parent.effects, *one.effects))]

    def pruned(self, explanation: Explanation) -> Explanation:
        return explanation


@pytest.mark.parametrize(("last", "effects"), [(1.0, [1, 3]), (3.3, [1])])
def test_an_effect_that_explains_half_stays_where_another_completes_it(last: float, effects: list[int]) -> None:
    search = OneAfterAnother(last)
    assert [len(level[0].effects) for level in search.one_by_one(search.base)[0]] == effects
