from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2, tip_positions
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.hand.urdf import roll_pitch_yaw


def test_the_urdf_puts_fingertips_where_the_kinematics_do() -> None:
    q = np.random.default_rng(1).uniform(DLR_HAND2.action_lower, DLR_HAND2.action_upper)
    model = mujoco.MjSpec.from_string(DLR_HAND2.urdf()).compile()
    data = mujoco.MjData(model)
    for k in range(4):
        for name, angle in zip(DLR_HAND2.chain_joints(k), DLR_HAND2.all_angles(q)[k], strict=True):
            data.joint(name).qpos[:] = angle
    mujoco.mj_kinematics(model, data)
    for finger, expected in zip(DLR_HAND2.fingers, tip_positions(DLR_HAND2, q), strict=True):
        body = data.body(f"{finger.name}_distal")
        tip = body.xpos + body.xmat.reshape(3, 3) @ [0.0, 0.0, 0.033]
        np.testing.assert_allclose(DLR_HAND2.position + DLR_HAND2.rotation @ tip, expected, atol=1e-8)


def test_finger_and_hand_have_the_same_links() -> None:
    finger = ElementTree.fromstring(DLR_HAND2.finger_urdf(3))
    hand = ElementTree.fromstring(DLR_HAND2.urdf())
    of_hand = {link.attrib["name"]: ElementTree.tostring(link) for link in hand.iter("link")}
    shared = [link for link in finger.iter("link") if link.attrib["name"] != "base"]
    assert len(shared) == 4
    for link in shared:
        same = ElementTree.tostring(link).replace(b'name="', b'name="thumb_')
        assert same.strip() == of_hand["thumb_" + link.attrib["name"]].strip()


def test_the_last_joint_of_each_finger_follows_the_third() -> None:
    tree = RigidBodyTree.from_urdf(DLR_HAND2.urdf())
    assert tree.joint_names == DLR_HAND2.joint_names
    assert tree.follow.tolist() == [0, 1, 2, 2, 3, 4, 5, 5, 6, 7, 8, 8, 9, 10, 11, 11]


@pytest.mark.parametrize("pitch", [0.3, -1.2, np.pi / 2, -np.pi / 2])
def test_roll_pitch_yaw_is_a_rotation_again_even_upright(pitch: float) -> None:
    rotation = Rotation.from_euler("xyz", [0.4, pitch, -2.0])
    again = Rotation.from_euler("xyz", roll_pitch_yaw(rotation.as_matrix()))
    assert (again.inv() * rotation).magnitude() < 1e-7
