"""A hand that lies palm up: the object rests on what no joint moves, fingers pass through it."""

from typing import Any

import numpy as np
import pytest
import yaml

from tactile_cube.composition import CONFIG
from tactile_cube.hand import Hand, hand_from_urdf
from tactile_cube.randomization import StartStates
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World, constants_of

ENGINES = ("bullet", "mujoco")


def leap(**changes: Any) -> Hand:
    plain: dict[str, Any] = yaml.safe_load((CONFIG / "hand" / "leap.yaml").read_text())
    plain.pop("_target_")
    return hand_from_urdf(**plain | changes)


def of_cube(hand: Hand) -> EpisodeConstants:
    return constants_of(hand, {"size": 0.07, "mass": 0.108}, filter_time=0.02, gravity_onset=0, link_friction=0.3)


def states(world: World, target: np.ndarray, steps: int) -> list[bytes]:
    """States of cube and joints after each step from the hand's own start."""
    world.reset(of_cube(world.hand), Start(world.hand.start_angles))
    found = []
    for _ in range(steps):
        world.step(target)
        found.append(world._cube.tobytes() + world.q.tobytes())
    return found


@pytest.mark.parametrize("engine", ENGINES)
def test_a_cube_rests_in_the_palm_and_nothing_of_an_episode_remains(engine: Any) -> None:
    hand = leap()
    world = World(hand, SimulationOptions(engine))
    first = states(world, hand.start_angles, 15)
    bodies = {contact.finger for contact in world.contacts() if contact.other == "cube"}
    assert "palm" in bodies
    assert np.linalg.norm(world.cube_linear_velocity) < 0.02
    assert -0.08 < world.cube_position[2] < -0.03
    world.step(hand.action_upper)  # leaves contacts that the next episode must not know
    assert states(world, hand.start_angles, 15) == first
    world.close()


@pytest.mark.parametrize("engine", ENGINES)
def test_fingers_do_not_touch_the_palm_and_without_contact_the_cube_falls_through(engine: Any) -> None:
    hand = leap(palm_contact=False)
    world = World(hand, SimulationOptions(engine))
    away = hand.action_lower.reshape(4, 4).copy()
    away[:, 1] = hand.action_upper.reshape(4, 4)[:, 1]
    states(world, away.ravel(), 4)
    assert world.cube_position[2] < -0.15
    fist = World(leap(), SimulationOptions(engine))
    fist.reset(of_cube(hand), Start(hand.start_angles, (0.0, 0.0, 3.0)))
    for _ in range(5):
        fist.step(hand.upper)
        assert not any("palm" in (contact.finger, contact.other) for contact in fist.contacts())
    world.close()
    fist.close()


def test_start_angles_that_a_description_gives_are_those_of_every_object() -> None:
    hand = leap()
    poses = StartStates().of(hand, of_cube(hand))
    np.testing.assert_array_equal(poses.angles, hand.start_angles[None])
