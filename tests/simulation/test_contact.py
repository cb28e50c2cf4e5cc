import numpy as np
import pytest

from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation import Contact, EpisodeConstants, SimulationOptions, Start, World
from tactile_cube.simulation.engine import EngineName


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
