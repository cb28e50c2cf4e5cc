from typing import Literal

import numpy as np
import pybullet
import pytest

from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World

HAND = DLR_HAND2


def episode(table_height: float | None) -> np.ndarray:
    world = World()
    rng, rows = np.random.default_rng(1), []
    for height in (None, table_height):
        world.reset(EpisodeConstants(table_height=height, filter_time=0.12), Start(HAND.start_angles))
        held = grasp_angles(HAND, [0.08] * 3, [0, 0, 0], [0, 0, 0.1, 1], -0.01)
        for k in range(16):
            world.step(held if k < 8 else rng.uniform(HAND.action_lower, HAND.action_upper))
            rows.append(np.concatenate([world.q, world.dq, world.cube_position, world.cube_quaternion]))
    world.close()
    return np.array(rows)


@pytest.mark.parametrize("table_height", [None, -0.04])
def test_the_plain_broadphase_gives_the_same_bits_as_the_tree(
    table_height: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = episode(table_height)
    monkeypatch.setattr(pybullet, "resetSimulation", lambda *_, **__: None)
    np.testing.assert_array_equal(plain, episode(table_height))


def test_links_that_are_spared_the_broadphase_have_no_shape() -> None:
    world = World()
    scene = world._engine
    for body in scene.fingers:
        for link in (-1, *range(4)):
            shapes = pybullet.getCollisionShapeData(body, link, physicsClientId=scene.client)
            assert bool(shapes) == (link >= 0 and bool(HAND.fingers[0].shapes[link]))
    world.close()


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_fingers_touch_the_table_and_each_other_but_not_themselves(engine: Literal["bullet", "mujoco"]) -> None:
    world, pairs, away = World(options=SimulationOptions(engine)), set(), Start(HAND.start_angles, (0.0, 0.0, 3.0))
    world.reset(EpisodeConstants(table_height=-0.01, filter_time=0.1, gravity_onset=99), away)
    crossing = HAND.start_angles.copy()
    crossing[[3, 6]] = np.radians([-28.0, 28.0])
    for _ in range(12):
        world.step(crossing)
        pairs |= {frozenset((contact.finger, contact.other)) for contact in world.contacts()}
    assert frozenset(("fore", "middle")) in pairs
    assert any("table" in pair for pair in pairs)
    assert all(len(pair) == 2 for pair in pairs)
    world.close()
