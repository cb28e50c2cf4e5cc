import numpy as np

from tactile_cube.drivetrain.laws import (
    add_tendons,
    estimate_contact,
    link_torques,
)

FOLLOW, LEADER = np.array([0, 1, 1]), np.array([0, 1])
RATIO, OFFSET = np.array([1.0, 1.0, 0.8]), np.array([0.0, 0.0, 0.1])
J = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.8]])


def equations(seed: int = 0):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3))
    return root @ root.T, rng.normal(size=3), rng


def test_an_impact_is_believed_up_to_a_limit() -> None:
    M, h, _ = equations()
    found = np.zeros(2)
    estimate_contact(FOLLOW, RATIO, M, h, np.zeros(3), np.array([1e4, -1e4, 0.0]), 5.0, found)
    assert np.max(np.abs(found)) == 5.0


def test_bullet_gets_the_wanted_accelerations_with_the_contact_that_it_adds() -> None:
    M, h, rng = equations()
    wanted, contact, torque = rng.normal(size=2), rng.normal(size=2), np.zeros(3)
    link_torques(FOLLOW, LEADER, RATIO, M, h, wanted, contact, torque)
    push = np.array([contact[0], contact[1], 0.0])
    np.testing.assert_allclose(np.linalg.solve(M, torque + push - h), J @ wanted)


def test_a_stretched_tendon_pulls_both_joints_together_without_a_net_power() -> None:
    torque = np.zeros(3)
    q, v = np.array([0.0, 0.5, 0.45]), np.array([0.0, 1.0, 0.6])
    add_tendons(FOLLOW, LEADER, RATIO, OFFSET, q, v, 15.0, 0.02, torque)
    pull = 15.0 * (0.8 * 0.5 + 0.1 - 0.45) + 0.02 * (0.8 - 0.6)
    np.testing.assert_allclose(torque, [0.0, -0.8 * pull, pull])
    assert abs(torque @ (J @ np.array([0.3, 0.7]))) < 1e-15
