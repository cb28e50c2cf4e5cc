import numpy as np

from tests.own_hands import own_hand


def test_velocity_of_the_tip_is_the_slope_of_its_place() -> None:
    hand = own_hand()
    chain, base, q = hand.fingers[2].chain, hand.base_in_world(2), np.array([[0.2, -0.3, 0.5, 0.9]])
    jacobian = chain.motion(*base, q)[1][0]
    for joint in range(4):
        step = np.where(np.arange(4) == joint, 1e-6, 0.0)
        slope = (chain.tips(*base, q + step) - chain.tips(*base, q - step))[0] / 2e-6
        np.testing.assert_allclose(jacobian[:, joint], slope, atol=1e-8)


def test_angles_bring_the_tip_to_points_within_reach() -> None:
    hand = own_hand()
    lower, upper = hand.action_lower[:4], hand.action_upper[:4]
    rng = np.random.default_rng(0)
    targets = hand.finger_tips(0, rng.uniform(0.7 * lower, 0.7 * upper, (20, 4)))
    found = hand.finger_angles(0, targets)
    assert np.all(found >= lower)
    assert np.all(found <= upper)
    assert np.median(np.linalg.norm(hand.finger_tips(0, found) - targets, axis=1)) < 1e-6


def test_a_point_out_of_reach_is_approached() -> None:
    hand = own_hand()
    found = hand.finger_angles(0, np.array([[0.0, -0.1, -0.5]]))
    straight = hand.finger_tips(0, np.zeros((1, 4)))
    assert hand.finger_tips(0, found)[0, 2] < straight[0, 2] + 0.02
