from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tactile_cube.env import BORNE_TERMS, Reward, RotationEnv, Task
from tactile_cube.env.touch import borne, normal_forces
from tactile_cube.hand import DLR_HAND2
from tactile_cube.randomization import GraspStarts, Randomization
from tactile_cube.simulation import SimulationOptions, World


def test_normal_forces_are_those_on_the_object_by_finger_and_kind_of_link() -> None:
    first, second = (finger.name for finger in DLR_HAND2.fingers[:2])
    touches = [
        (first, DLR_HAND2.link_names(0)[-1], "cube", 1.0),
        (first, DLR_HAND2.link_names(0)[-1], "cube", 0.5),
        (second, DLR_HAND2.link_names(1)[1], "cube", 2.0),
        (first, DLR_HAND2.link_names(0)[1], second, 9.0),
        ("table", "", "cube", 9.0),
    ]
    contacts = [SimpleNamespace(finger=f, link=k, other=o, force=n) for f, k, o, n in touches]
    world: Any = SimpleNamespace(hand=DLR_HAND2, contacts=lambda: contacts)
    assert normal_forces(world).tolist() == [[0.0, 2.0, 0.0, 0.0], [1.5, 0.0, 0.0, 0.0]]


@pytest.mark.parametrize(
    ("links", "tips", "expected"),
    [
        ([0, 0, 0, 0], [1, 1, 1, 0], (1.0, 0.0, 0.0)),
        ([0, 1, 0, 0], [1, 1, 1, 0], (1.0, 1.0, 0.25)),
        ([0.01, 0, 0, 0], [1, 1, 0.01, 0], (0.0, 0.0, 0.01 / 2.02)),
        ([0, 0, 0, 0], [0, 0, 0, 0], (0.0, 0.0, 0.0)),
    ],
)
def test_three_tips_support_and_other_links_have_a_share(
    links: list[float], tips: list[float], expected: tuple[float, ...]
) -> None:
    assert borne(np.array([links, tips], dtype=float)) == pytest.approx(expected)


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_a_grasp_is_held_by_tips_alone(engine: Any) -> None:
    world = World(DLR_HAND2, SimulationOptions(engine=engine))
    start = GraspStarts().of(DLR_HAND2)
    env = RotationEnv(world, Task("full"), Reward(tips=1.0), Randomization(), start)
    env.reset()
    grasp = (world.q_f - env._middle) / env._half_range
    held = dict(zip(BORNE_TERMS, env.step(grasp).reward_terms[-5:].tolist(), strict=True))
    assert (held["tips"], held["links"], held["link_force"]) == (1.0, 0.0, 0.0)
    world.close()


@pytest.mark.parametrize(("link", "paid"), [(-1, 0.0), (1, 0.05)])
def test_a_turn_counts_as_the_links_own_only_while_one_touches(
    link: int, paid: float, scripted_world: Any, rotation_task: Any
) -> None:
    world = scripted_world(turn=0.05)
    name = DLR_HAND2.fingers[2].name
    touch = SimpleNamespace(finger=name, link=DLR_HAND2.link_names(2)[link], other="cube", force=1.0)
    world.contacts, world.hand = lambda: [touch], DLR_HAND2
    env = rotation_task(world, task=Task("full", direction=1), reward=Reward(link_spin=8.0))
    env.reset()
    terms = dict(zip(BORNE_TERMS, env.step(np.zeros(12)).reward_terms[-5:].tolist(), strict=True))
    assert terms["link_spin"] == pytest.approx(paid)
