"""Contact that PyBullet's solver does not resolve is named."""

from dataclasses import replace

import pytest

from tactile_cube.env import Task
from tactile_cube.randomization import Randomization, Uniform
from tactile_cube.simulation import EpisodeConstants, SimulationOptions
from tactile_cube.simulation.health import unresolved, unresolved_among
from tactile_cube.transforms import EnvConfig

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
