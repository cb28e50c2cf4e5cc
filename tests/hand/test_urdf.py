from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2, tip_positions
from tactile_cube.hand.urdf import roll_pitch_yaw

Chain = dict[str, ElementTree.Element]


def joints_by_child(urdf: str) -> Chain:
    robot = ElementTree.fromstring(urdf)
    return {joint.find("child").attrib["link"]: joint for joint in robot.iter("joint")}  # type: ignore[union-attr]


def numbers(element: ElementTree.Element, path: str, attribute: str) -> np.ndarray:
    return np.array([float(x) for x in element.find(path).attrib[attribute].split()])  # type: ignore[union-attr]


def link_pose(joints: Chain, link: str, angles: dict[str, float]) -> tuple[np.ndarray, Rotation]:
    """Pose of a link in the root, walking up the joints."""
    position, rotation = np.zeros(3), Rotation.identity()
    while link in joints:
        joint = joints[link]
        turn = Rotation.from_rotvec(numbers(joint, "axis", "xyz") * angles[joint.attrib["name"]])
        place = Rotation.from_euler("xyz", numbers(joint, "origin", "rpy"))
        position = numbers(joint, "origin", "xyz") + (place * turn).apply(position)
        rotation = place * turn * rotation
        link = joint.find("parent").attrib["link"]  # type: ignore[union-attr]
    return position, rotation


def test_the_urdf_puts_fingertips_where_the_kinematics_do() -> None:
    rng = np.random.default_rng(1)
    q = rng.uniform(DLR_HAND2.action_lower, DLR_HAND2.action_upper)
    tips = tip_positions(DLR_HAND2, q)
    joints = joints_by_child(DLR_HAND2.urdf())
    for k, finger in enumerate(DLR_HAND2.fingers):
        own = [*q[3 * k : 3 * k + 3], q[3 * k + 2]]
        angles = {f"{finger.name}_q{j + 1}": angle for j, angle in enumerate(own)}
        position, rotation = link_pose(joints, f"{finger.name}_distal", angles)
        tip = position + rotation.apply([0.0, 0.0, 0.033])
        np.testing.assert_allclose(DLR_HAND2.position + DLR_HAND2.rotation @ tip, tips[k], atol=1e-8)


def test_finger_and_hand_have_the_same_links() -> None:
    finger = ElementTree.fromstring(DLR_HAND2.finger_urdf(3))
    hand = ElementTree.fromstring(DLR_HAND2.urdf())
    of_hand = {link.attrib["name"]: ElementTree.tostring(link) for link in hand.iter("link")}
    shared = [link for link in finger.iter("link") if link.attrib["name"] != "base"]
    assert len(shared) == 4
    for link in shared:
        same = ElementTree.tostring(link).replace(b'name="', b'name="thumb_')
        assert same.strip() == of_hand["thumb_" + link.attrib["name"]].strip()


def test_the_last_joint_mimics_the_third() -> None:
    joint = joints_by_child(DLR_HAND2.urdf())["fore_distal"]
    assert joint.find("mimic").attrib["joint"] == "fore_q3"  # type: ignore[union-attr]


def test_capsules_are_centred_on_the_centres_of_mass() -> None:
    for link in ElementTree.fromstring(DLR_HAND2.finger_urdf(0)).iter("link"):
        if (shape := link.find("collision/origin")) is not None:
            assert shape.attrib["xyz"] == link.find("inertial/origin").attrib["xyz"]  # type: ignore[union-attr]


@pytest.mark.parametrize("pitch", [0.3, -1.2, np.pi / 2, -np.pi / 2])
def test_roll_pitch_yaw_is_a_rotation_again_even_upright(pitch: float) -> None:
    rotation = Rotation.from_euler("xyz", [0.4, pitch, -2.0])
    again = Rotation.from_euler("xyz", roll_pitch_yaw(rotation.as_matrix()))
    assert (again.inv() * rotation).magnitude() < 1e-7
