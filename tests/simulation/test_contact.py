"""What friction does in both engines: forces at sliding contacts, what holds a cube against sliding and spinning."""

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest

from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation import Contact, EpisodeConstants, SimulationOptions, Start, World
from tactile_cube.simulation.engine import EngineName, Surface


@pytest.fixture(scope="module", params=["bullet", "mujoco"])
def squeezed(request: pytest.FixtureRequest) -> list[Contact]:
    world = World(options=SimulationOptions(request.param))
    world.reset(EpisodeConstants(), Start(DLR_HAND2.start_angles))
    for _ in range(40):
        world.step(grasp_angles(DLR_HAND2, [0.08] * 3, [0, 0, 0], [0, 0, 0, 1], -0.01))
    contacts = world.contacts()
    world.close()
    return contacts


def test_every_fingertip_touches_its_face(squeezed: list[Contact]) -> None:
    by_finger = {contact.finger: contact for contact in squeezed}
    for finger in DLR_HAND2.fingers:
        contact = by_finger[finger.name]
        assert (contact.link, contact.other) == ("distal", "cube")
        assert contact.position @ finger.face == pytest.approx(0.04, abs=3e-3)
        assert contact.normal @ -finger.face > 0.9
        assert 0.3 < contact.force < 5.0
        assert abs(contact.distance) < 1e-3


def test_contact_forces_on_the_cube_carry_its_weight(squeezed: list[Contact]) -> None:
    total = sum(contact.force * contact.normal + contact.friction for contact in squeezed)
    np.testing.assert_allclose(total, [0, 0, 0.05 * 9.81], atol=0.05)


def test_friction_stays_within_the_cone(squeezed: list[Contact]) -> None:
    for contact in squeezed:
        assert np.linalg.norm(contact.friction) <= 0.9 * contact.force * 1.02
        assert abs(contact.friction @ contact.normal) < 1e-6


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_fingers_touch_the_table_and_each_other_but_not_themselves(engine: EngineName) -> None:
    world, pairs, away = World(options=SimulationOptions(engine)), set(), Start(DLR_HAND2.start_angles, (0.0, 0.0, 3.0))
    world.reset(EpisodeConstants(table_height=-0.01, filter_time=0.1, gravity_onset=99), away)
    crossing = DLR_HAND2.start_angles.copy()
    crossing[[3, 6]] = np.radians([-28.0, 28.0])
    for _ in range(12):
        world.step(crossing)
        pairs |= {frozenset((contact.finger, contact.other)) for contact in world.contacts()}
    assert frozenset(("fore", "middle")) in pairs
    assert any("table" in pair for pair in pairs)
    assert all(len(pair) == 2 for pair in pairs)
    world.close()


ALL, OPPOSING = (0, 1, 2, 3), (0, 2)
SETTLED, WEIGHT = 15, 0.05 * 9.81


@pytest.fixture(scope="module", params=["bullet", "mujoco"])
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    world = World(options=SimulationOptions(request.param))
    yield world
    world.close()


def held(world: World, constants: EpisodeConstants, fingers: tuple[int, ...]) -> np.ndarray:
    """Squeezes a weightless cube with some of the fingers, the others away; gives the targets (12,) that hold it."""
    target = grasp_angles(DLR_HAND2, [0.08] * 3, [0, 0, 0], [0, 0, 0, 1], -0.01).reshape(4, 3)
    target[[k for k in ALL if k not in fingers]] = (0.0, -0.15, 0.0)
    world.reset(constants, Start(DLR_HAND2.start_angles))
    for _ in range(SETTLED):
        world.step(target.ravel())
    return target.ravel()


def on_the_cube(world: World) -> list[Contact]:
    return [contact for contact in world.contacts() if contact.other == "cube" and contact.force > 0.05]


def normal_force(world: World) -> float:
    return sum(contact.force for contact in on_the_cube(world))


def test_what_two_surfaces_are_together_does_not_depend_on_which_is_named_first() -> None:
    skin, hard = Surface(0.9, 0.003, 3e-4), Surface(0.5, 0.001)
    assert skin.on(hard) == hard.on(skin)


@pytest.mark.parametrize(("tip_friction", "cube_friction"), [(0.9, 1.0), (0.4, 1.0), (0.9, 0.5)])
def test_tips_hold_the_cube_up_to_friction_times_normal_force(world, tip_friction, cube_friction) -> None:
    constants = EpisodeConstants(
        tip_friction=tip_friction, cube_friction=cube_friction, filter_time=0.1, gravity_onset=1000
    )
    lifted = []
    for share in (0.8, 1.3):
        target = held(world, constants, ALL)
        before = world.cube_position[2]
        world.push_cube(np.array([0.0, 0.0, share * tip_friction * cube_friction * normal_force(world)]), np.zeros(3))
        for _ in range(3):
            world.step(target)
        lifted.append(world.cube_position[2] - before)
    assert lifted[0] < 3e-3
    assert lifted[1] > 20e-3


@pytest.mark.parametrize(("tip_friction", "link_friction"), [(0.9, 0.09), (0.4, 0.2)])
def test_a_sliding_cube_is_braked_by_the_friction_of_the_part_that_it_slides_on(
    world: World, tip_friction: float, link_friction: float
) -> None:
    constants = EpisodeConstants(
        tip_friction=tip_friction, link_friction=link_friction, filter_time=0.1, gravity_onset=1000
    )
    target = held(world, constants, ALL)
    world.push_cube(np.array([0.0, 0.0, 8.0]), np.zeros(3))  # drags it upwards along tips and links
    ratios: dict[bool, list[float]] = {True: [], False: []}
    for _ in range(4):
        world.step(target)
        for contact in on_the_cube(world):
            ratios[contact.link == "distal"].append(float(np.linalg.norm(contact.friction)) / contact.force)
    assert max(ratios[True]) == pytest.approx(tip_friction, rel=0.01)
    assert max(ratios[False]) == pytest.approx(link_friction, rel=0.01)


@pytest.mark.parametrize(("spinning_friction", "cube_friction"), [(0.001, 1.0), (0.003, 1.0), (0.003, 0.6)])
def test_two_tips_hold_a_weight_at_a_lever_up_to_spinning_friction_times_normal_force(
    world: World, spinning_friction: float, cube_friction: float
) -> None:
    turned = []
    grip = EpisodeConstants(
        tip_spinning_friction=spinning_friction,
        tip_friction=0.9,
        cube_friction=cube_friction,
        filter_time=0.1,
        gravity_onset=SETTLED,
    )
    held(world, grip, OPPOSING)
    limit = spinning_friction * cube_friction * normal_force(world)
    for share in (0.7, 1.4):
        constants = dataclasses.replace(grip, cube_com=(share * limit / WEIGHT, 0.0, 0.0))
        target = held(world, constants, OPPOSING)
        before = world.cube_quaternion[1]
        for _ in range(5):
            world.step(target)
        turned.append(2.0 * abs(world.cube_quaternion[1] - before))
    assert turned[0] < 0.02
    assert turned[1] > 0.1
