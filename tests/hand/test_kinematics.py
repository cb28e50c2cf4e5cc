import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2, grasp_angles, tip_positions


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
