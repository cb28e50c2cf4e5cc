import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World, constants_of
from tactile_cube.simulation.engine import EngineName
from tests.own_hands import own_hand


def moved(engine: EngineName, **values: object) -> World:
    """The hand of three fingers after half a second away from the object's sides, and on them."""
    hand = own_hand()
    world = World(hand, SimulationOptions(engine))
    world.reset(constants_of(hand, filter_time=0.05, **values), Start(hand.start_angles))  # type: ignore[arg-type]
    for _ in range(5):
        world.step(hand.start_angles - np.tile([0.1, 0.2, 0.1, 0.1], 3))
    return world


def test_both_engines_move_a_hand_of_three_fingers_alike() -> None:
    worlds = [moved(engine) for engine in ("bullet", "mujoco")]
    bullet, mujoco = (world.q for world in worlds)
    assert np.all(np.abs(bullet - own_hand().start_angles) > 0.05)
    np.testing.assert_allclose(bullet, mujoco, atol=2e-3)  # as with the DLR-Hand II, in free motion
    for world in worlds:
        assert world.healthy
        world.close()


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
@pytest.mark.parametrize("shape", ["cylinder", "capsule"])
def test_fingers_touch_a_round_object_by_the_names_of_their_links(engine: EngineName, shape: str) -> None:
    hand = own_hand()
    world = World(hand, SimulationOptions(engine))
    object_ = {"shape": shape, "size": [0.08, 0.08, 0.08], "mass": 0.05}
    world.reset(constants_of(hand, object_, filter_time=0.05, gravity_scale=0.0), Start(hand.start_angles))
    inwards = np.tile([0.0, 0.15, 0.1, 0.1], 3)
    for _ in range(5):
        world.step(hand.start_angles + inwards)
    touching = {(contact.finger, contact.link) for contact in world.contacts() if contact.other == "cube"}
    assert {finger for finger, _ in touching} == {"left", "right", "thumb"}
    assert all(link == f"{finger}_distal" for finger, link in touching)
    assert world.healthy
    world.close()


def test_constants_of_another_hand_are_refused() -> None:
    hand = own_hand("left", "right")
    world = World(own_hand(), SimulationOptions("mujoco"))
    with pytest.raises(InputError, match="hand 'three_finger' has 12 joints; the constants are of 8"):
        world.reset(constants_of(hand), Start(hand.start_angles))


def test_drives_and_objects_say_what_they_do_not_know() -> None:
    assert constants_of(own_hand()).kp[0] == 3.0  # type: ignore[index]
    with pytest.raises(InputError, match=r"hand\.drive\.kq: no such constant"):
        constants_of(own_hand(drive={"kq": 1.0}))
    with pytest.raises(InputError, match=r"object\.colour: no such setting"):
        constants_of(None, {"colour": "red"})
    with pytest.raises(InputError, match="give diameter, diameter and height"):
        EpisodeConstants(object_shape="cylinder", cube_size=(0.08, 0.07, 0.08))
