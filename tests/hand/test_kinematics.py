import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2, grasp_angles, tip_positions
from tests.own_hands import own_hand


def test_a_straight_finger_reaches_its_length() -> None:
    tips = tip_positions(DLR_HAND2, np.zeros(12))
    for k, tip in enumerate(tips):
        origin, rotation = DLR_HAND2.base_in_world(k)
        np.testing.assert_allclose(tip, origin + rotation[:, 0] * (0.075 + 0.040 + 0.033), atol=1e-12)


def test_inverse_kinematics_recovers_flexed_angles() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        q = rng.uniform([-0.5, -0.3, 0.05] * 4, [0.5, 0.9, 1.0] * 4)
        tips = tip_positions(DLR_HAND2, q)
        for k in range(4):
            np.testing.assert_allclose(DLR_HAND2.finger_angles(k, tips[k])[0], q[3 * k : 3 * k + 3], atol=1e-8)


def test_a_point_out_of_reach_is_pointed_at_by_a_straight_finger() -> None:
    origin, rotation = DLR_HAND2.base_in_world(1)
    target = origin + rotation @ np.array([0.4, 0.0, 0.3])
    q1, q2, q3 = DLR_HAND2.finger_angles(1, target)[0]
    assert q1 == pytest.approx(0.0)
    assert q2 == pytest.approx(np.arctan2(0.3, 0.4))
    assert q3 == 0.0


@pytest.mark.parametrize("yaw", [-45, -20, 0, 20, 45])
@pytest.mark.parametrize("clearance", [1e-3, 5e-3])
def test_fingers_stand_off_their_faces_at_any_yaw(yaw: float, clearance: float) -> None:
    turn = Rotation.from_euler("z", yaw, degrees=True)
    position = np.array([0.001, -0.001, 0.003])
    q = grasp_angles(DLR_HAND2, [0.08] * 3, position, turn.as_quat(), clearance)
    tips = turn.inv().apply(tip_positions(DLR_HAND2, q) - position)
    for finger, tip in zip(DLR_HAND2.fingers, tips, strict=True):
        assert finger.face @ tip - 0.04 - DLR_HAND2.tip_radius == pytest.approx(clearance, abs=2e-4)
        assert np.abs(tip - finger.face * (finger.face @ tip)).max() < 0.036


def test_grasps_respect_the_action_limits_even_where_the_cube_is_out_of_reach() -> None:
    q = grasp_angles(DLR_HAND2, [0.08] * 3, [0.1, 0.0, 0.0], [0, 0, 0, 1])
    assert np.all(q >= DLR_HAND2.action_lower)
    assert np.all(q <= DLR_HAND2.action_upper)


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


# fixed-axis roll, pitch, yaw of the same finger bases as the robot description package gives them [rad]
PUBLISHED_RPY = [
    (0.1446, -1.4855, -2.4465),
    (-0.3846, -1.3373, -2.7085),
    (-0.3846, -1.3373, -2.7085),
    (0.5470, -0.9824, -0.5784),
]


def test_finger_bases_agree_with_the_second_published_form() -> None:
    for finger, rpy in zip(DLR_HAND2.fingers, PUBLISHED_RPY, strict=True):
        np.testing.assert_allclose(finger.rotation, Rotation.from_euler("xyz", rpy).as_matrix(), atol=1e-4)


def test_start_pose_has_every_tip_one_millimetre_off_its_face_at_mid_height() -> None:
    tips = tip_positions(DLR_HAND2, DLR_HAND2.start_angles)
    for finger, tip in zip(DLR_HAND2.fingers, tips, strict=True):
        gap = finger.face @ tip - 0.04 - DLR_HAND2.tip_radius
        assert abs(gap - 1e-3) < 3e-4
        assert np.linalg.norm(tip - finger.face * (finger.face @ tip)) < 5e-4
    assert np.all(DLR_HAND2.start_angles > DLR_HAND2.action_lower)
    assert np.all(DLR_HAND2.start_angles < DLR_HAND2.action_upper)
