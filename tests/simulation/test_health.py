from dataclasses import replace

import numpy as np
import pytest

from tactile_cube.env import Task
from tactile_cube.randomization import Randomization, Uniform
from tactile_cube.simulation import EpisodeConstants, SimulationOptions
from tactile_cube.simulation.health import find_fault, unresolved, unresolved_among
from tactile_cube.transforms import EnvConfig

TENDON = np.array([[3, 2]])  # q4 follows q3
CALM, STILL = np.full((4, 4), 0.4), np.zeros((4, 4))
CUBE = np.array([0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0], dtype=float)


def changed(array: np.ndarray, index: object, value: float) -> np.ndarray:
    copy = array.copy()
    copy[index] = value  # type: ignore[index]
    return copy


def test_a_calm_state_has_no_fault() -> None:
    assert find_fault(CALM, STILL, CUBE, [-0.001, 0.002], TENDON) == ""


@pytest.mark.parametrize(
    ("state", "word"),
    [
        ((changed(CALM, (0, 0), np.nan), STILL, CUBE, []), "joint speed is not a number"),
        ((CALM, changed(STILL, (2, 1), np.nan), CUBE, []), "joint speed is not a number"),
        ((CALM, changed(STILL, (1, 2), -80.0), CUBE, []), "joint speed"),
        ((CALM, STILL, changed(CUBE, 8, 6.0), []), "cube speed"),
        ((CALM, STILL, changed(CUBE, 11, -200.0), []), "cube spin"),
        ((CALM, STILL, CUBE, [0.0, -0.01]), "overlap"),
        ((CALM, STILL, changed(CUBE, 5, np.inf), []), "cube speed is not a number"),
        ((changed(CALM, (1, 3), 0.9), STILL, CUBE, []), "tendon stretch"),
    ],
)
def test_what_cannot_be_is_named(state: tuple[np.ndarray, np.ndarray, np.ndarray, list[float]], word: str) -> None:
    assert word in find_fault(*state, TENDON)


PAPER = 0.1
NOMINAL = EpisodeConstants().tip_spinning_friction


@pytest.mark.parametrize(
    ("spinning", "options", "named"),
    [
        (PAPER, SimulationOptions("bullet"), True),
        (PAPER, SimulationOptions("mixed"), True),
        (PAPER, SimulationOptions.faithful("bullet"), True),
        (PAPER, SimulationOptions("bullet", dt=2e-4, substeps=500, solver_iterations=300), False),
        (PAPER, SimulationOptions("mujoco"), False),
        (NOMINAL, SimulationOptions("bullet"), False),
    ],
)
def test_what_is_not_resolved_is_named(spinning: float, options: SimulationOptions, named: bool) -> None:
    assert ("0.1 m" in unresolved(spinning, options)) == named


def test_only_worlds_that_are_not_resolved_are_counted() -> None:
    bullet, mujoco = SimulationOptions("bullet"), SimulationOptions("mujoco")
    assert unresolved_among([0.003, 0.09, 0.06], bullet).startswith("2 of 3 worlds: tip_spinning_friction of 0.09 m: ")
    assert unresolved_among([0.009, 0.02], bullet) == unresolved_among([PAPER], mujoco) == ""


def test_the_largest_friction_that_an_episode_can_draw_counts() -> None:
    config = EnvConfig(Task("full"), constants=EpisodeConstants(tip_spinning_friction=PAPER))
    assert config.approximations()
    narrow = Randomization(values={"tip_spinning_friction": Uniform(0.001, 0.02)})
    assert not replace(config, randomization=narrow).approximations()
    wide = Randomization(values={"tip_spinning_friction": Uniform(0.001, 0.08)})
    assert replace(EnvConfig(Task("full")), randomization=wide).approximations()
