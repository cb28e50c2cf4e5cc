import numpy as np
import pytest

from tactile_cube.drivetrain.effects import CONTACT, Effect, find_effect
from tactile_cube.hand import DLR_HAND2
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.simulation import EpisodeConstants, Start, World
from tactile_cube.simulation.engine import (
    TENDON_DAMPING,
    TENDON_STIFFNESS,
    SimulationOptions,
    spin_inertia,
    spin_shares,
)

NOWHERE = (0.0, 0.0, 3.0)


def free_motion(world: World) -> np.ndarray:
    world.reset(EpisodeConstants(filter_time=0.1), Start(DLR_HAND2.start_angles, NOWHERE))
    for k in range(4):
        world.step(DLR_HAND2.start_angles + 0.1 * (-1) ** k)
    return world.q


def effects(mass: float, excess: float) -> list[Effect]:
    """A payload on the ring finger's tip and more dry friction in the middle finger: one kernel for all tests."""
    payload, friction = find_effect("payload"), find_effect("stribeck_friction")
    return [payload("ring_q3", mass=mass, distance=0.03), friction("middle_q2", excess=excess, velocity=0.2)]


def test_a_payload_moves_in_bullet_as_the_control_step_expects() -> None:
    world = World(effects=effects(mass=0.1, excess=0.0))
    free_motion(world)
    # what Bullet did beyond the control step's equations would look like a contact
    np.testing.assert_allclose(world._drive.signal(CONTACT), 0.0, atol=1e-9)
    world.close()


def test_effects_act_on_their_finger_alone() -> None:
    plain, changed = World(), World(effects=effects(mass=0.1, excess=0.3))
    difference = np.abs(free_motion(plain) - free_motion(changed))
    assert difference[:3].max() > 5e-3
    assert difference[4] > 2e-3
    np.testing.assert_array_equal(difference[6:], 0.0)
    plain.close()
    changed.close()


def test_effects_at_their_neutral_value_change_nothing_to_the_bit() -> None:
    plain, neutral = World(), World(effects=effects(mass=0.0, excess=0.0))
    for world in (plain, neutral):
        world.reset(EpisodeConstants(), Start(DLR_HAND2.start_angles))
        for _ in range(10):
            world.step(DLR_HAND2.start_angles + 0.05)
    np.testing.assert_array_equal(plain.q, neutral.q)
    np.testing.assert_array_equal(plain.cube_position, neutral.cube_position)
    plain.close()
    neutral.close()


@pytest.mark.parametrize("target", [None, DLR_HAND2.start_angles + 0.2])
def test_the_filter_starts_where_the_start_says(target: np.ndarray | None) -> None:
    offset = np.full(12, 0.03)
    world = World()
    world.reset(EpisodeConstants(joint_offset=offset), Start(DLR_HAND2.start_angles, target=target))
    np.testing.assert_allclose(world.q_f, DLR_HAND2.start_angles + offset if target is None else target, atol=1e-15)
    world.close()


SHARES = spin_shares(RigidBodyTree.from_urdf(DLR_HAND2.finger_urdf(0)))


def test_links_spin_with_their_share_of_the_rotors_inertia() -> None:
    np.testing.assert_allclose(spin_inertia(DLR_HAND2, SHARES, np.full(12, 6e-3))[2], [6e-3, 3e-3, 2e-3, 1e-3])


def test_the_tendon_is_stable_however_small_the_rotors_are() -> None:
    dt = SimulationOptions().dt
    j3, j4 = spin_inertia(DLR_HAND2, SHARES, np.zeros(12))[0, 2:]
    w = (j3 + 4 * j4) / (j3 * j4)
    assert TENDON_STIFFNESS * dt**2 * w + 2 * TENDON_DAMPING * dt * w < 4
