import dataclasses
from typing import Any

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.env import Task
from tactile_cube.errors import InputError
from tactile_cube.evaluation.protocol import NumbPolicy, Protocol, Pull, Variant, numb_reading
from tactile_cube.randomization import Randomization, Uniform
from tactile_cube.transforms import EnvConfig
from tests.own_hands import own_hand


@pytest.mark.parametrize("wrong", [{"episodes": 0}, {"seconds": -1.0}, {"variants": ()}, {"film": -1}, {"worlds": "x"}])
def test_impossible_protocols_are_refused_by_key(wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=f"protocol.{next(iter(wrong))}"):
        Protocol("x", **wrong)


def test_the_catalogue_adds_one_variant_for_each_effect() -> None:
    conditions = Protocol("x", catalogue=True).conditions()
    assert len(conditions) == 1 + len(catalogue())
    assert {name for variant in conditions for name in variant.effects} == set(catalogue())


def test_each_finger_of_whichever_hand_can_be_numbed() -> None:
    numb = Protocol("x", numb_fingers=True)
    assert [one.numb for one in numb.conditions()[1:]] == [("ring",), ("middle",), ("fore",), ("thumb",)]
    assert [one.name for one in numb.conditions(own_hand())[1:]] == ["left numb", "right numb", "thumb numb"]


def config() -> EnvConfig:
    randomization = Randomization(
        values={"tip_friction": Uniform(0.8, 1.0)}, shifts={"cube_mass": Uniform(-0.005, 0.005)}
    )
    return EnvConfig(Task("full"), randomization=randomization)


def test_the_nominal_variant_changes_nothing() -> None:
    before, after = config(), Variant().apply(config())
    assert after.randomization == before.randomization
    assert after.simulation == before.simulation
    assert list(after.effects) == []


def test_a_varied_constant_is_no_longer_replaced_by_the_randomisation() -> None:
    changed = Variant(constants={"tip_friction": 0.4, "cube_mass": 0.2}).apply(config())
    drawn = changed.randomization.constants(changed.constants, np.random.default_rng(0))
    assert drawn.tip_friction == 0.4
    assert 0.195 <= drawn.cube_mass <= 0.205


def test_a_cuboid_keeps_its_shape() -> None:
    changed = Variant(constants={"cube_size": [0.09, 0.08, 0.08]}).apply(config())
    np.testing.assert_allclose(changed.constants.cube_size, [0.09, 0.08, 0.08])


def test_solver_settings_are_replaced() -> None:
    changed = Variant(simulation={"dt": 0.001, "substeps": 100}).apply(config())
    assert changed.simulation == dataclasses.replace(config().simulation, dt=0.001, substeps=100)


@pytest.mark.parametrize("group", ["constants", "simulation"])
def test_unknown_keys_are_refused(group: str) -> None:
    with pytest.raises(InputError, match=f"{group}.weight is unknown"):
        Variant(**{group: {"weight": 1.0}})


def test_a_pull_at_an_unknown_finger_is_refused() -> None:
    with pytest.raises(InputError, match="little"):
        Variant(pull=Pull("little", 1.0)).apply(config())


def test_every_effect_of_the_catalogue_has_a_typical_size() -> None:
    for name in catalogue():
        effects = Variant(effects=(name,)).apply(config()).effects
        assert {type(effect).name for effect in effects} == {name}
        assert all(one.values == {p.name: p.typical for p in one.parameters} for one in effects)


class Echo:
    """Acts as it observes."""

    def start(self, env: object, seed: int) -> None:
        pass

    def act(self, observation: np.ndarray, step: int) -> np.ndarray:
        return observation


def felt(numb: list[str]) -> np.ndarray:
    """Which numbers of a stack of two readings still follow the world, (2, 24)."""
    policy = NumbPolicy(Echo(), numb)  # type: ignore[arg-type]
    first, later = np.zeros(48, dtype=np.float32), np.ones(48, dtype=np.float32)
    assert np.array_equal(policy.act(first, 0), first)
    return policy.act(later, 1).reshape(2, 24)


def test_only_what_is_numb_is_not_felt() -> None:
    np.testing.assert_array_equal(felt(["q_m"]), np.tile(np.arange(24) >= 12, (2, 1)))
    np.testing.assert_array_equal(felt(["e_q"]), np.tile(np.arange(24) < 12, (2, 1)))
    assert np.flatnonzero(felt(["middle"])[0] == 0).tolist() == [3, 4, 5, 15, 16, 17]
    assert not felt(["q_m", "e_q"]).any()


def test_unknown_senses_are_refused() -> None:
    with pytest.raises(InputError, match=r"'nose'; choose from q_m, e_q, ring"):
        Variant(numb=("nose",)).apply(EnvConfig(Task("full")))
    assert not numb_reading(()).any()
