import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2, tip_positions

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


def test_start_pose_lies_within_the_action_limits() -> None:
    assert np.all(DLR_HAND2.start_angles > DLR_HAND2.action_lower)
    assert np.all(DLR_HAND2.start_angles < DLR_HAND2.action_upper)
