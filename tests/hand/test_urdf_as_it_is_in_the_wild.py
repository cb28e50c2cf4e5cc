"""What public collections of robots have in their URDFs, and files that only look like a URDF."""

from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, tip_positions
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.hand.urdf import roll_pitch_yaw
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.rig import read_rig
from tests.measurement.small_rig import URDF, write

PUBLIC = Path(__file__).parents[3] / "shared" / "robots"
BASE = '<link name="base"/>'
WELDED = '<joint name="weld" type="fixed"><parent link="{on}"/><child link="part"/>{more}</joint>'
PART = (
    '<link name="part"><inertial><origin xyz="0.02 0.01 0"/><mass value="0.2"/>'
    '<inertia ixx="1.296e-5" iyy="7.106e-5" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)


def with_part(on: str, zz: str = "9.982e-5", more: str = "") -> str:
    """The small rig with a part that no body could be, of the Allegro hand's moments."""
    return URDF.replace(BASE, BASE + PART.format(zz=zz) + WELDED.format(on=on, more=more))


def test_impossible_moments_of_what_moves_are_those_of_mujocos_balanceinertia() -> None:
    text, q = with_part("upper"), np.array([0.3, -0.4])
    tree = RigidBodyTree.from_urdf(text)
    extension = '<mujoco><compiler balanceinertia="true" fusestatic="false"/></mujoco></robot>'
    model = mujoco.MjModel.from_xml_string(text.replace("</robot>", extension))
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    expected = np.zeros((2, 2))
    mujoco.mj_fullM(model, data, expected)
    np.testing.assert_allclose(tree.actuated_mass_matrix(q), expected, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("zz", ["9.982e-5", "-3.5e-8"])
def test_the_user_reads_which_link_was_changed_and_how(tmp_path: Path, zz: str) -> None:
    (said,) = read_recording(write(tmp_path, urdf=with_part("lower", zz))).warnings
    assert "rig.urdf" in said
    assert "'part'" in said
    assert "mean" in said
    assert f"{(1.296e-5 + 7.106e-5 + float(zz)) / 3:.4g}" in said


def test_nothing_is_said_of_moments_that_nothing_moves(tmp_path: Path) -> None:
    assert read_recording(write(tmp_path, urdf=with_part("base", "-3.5e-8"))).warnings == ()


@pytest.mark.parametrize("zz", ["nan", "-1"])
def test_moments_without_a_mean_stay_refused(zz: str) -> None:
    with pytest.raises(InputError, match="inertia"):
        RigidBodyTree.from_urdf(with_part("upper", zz))


def test_the_axis_of_a_fixed_joint_means_nothing() -> None:
    plain = RigidBodyTree.from_urdf(with_part("upper", "8e-5"))
    zero = RigidBodyTree.from_urdf(with_part("upper", "8e-5", '<axis xyz="0 0 0"/>'))
    q = np.array([0.3, -0.4])
    assert np.array_equal(plain.actuated_mass_matrix(q), zero.actuated_mass_matrix(q))


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_joint_without_a_drive_is_held_and_said(kind: str) -> None:
    tree = RigidBodyTree.from_urdf(with_part("base", "8e-5").replace("fixed", kind))
    assert tree.joint_names == ("a", "b")
    assert tree.corrected == (f"joint 'weld' is {kind}; its link 'part' is held",)


@pytest.mark.parametrize("end", ["1e16", "inf"])
def test_a_limit_beyond_all_numbers_is_none(end: str) -> None:
    text = URDF.replace('lower="-0.5" upper="0.5"', f'lower="-{end}" upper="{end}"')
    assert RigidBodyTree.from_urdf(text).upper[0] == np.inf
    with pytest.raises(InputError, match='upper="nan"'):
        RigidBodyTree.from_urdf(text.replace(f'upper="{end}"', 'upper="nan"'))


def test_a_byte_order_mark_and_empty_lines_before_the_text_are_passed_over() -> None:
    assert RigidBodyTree.from_urdf(f'\ufeff\n<?xml version="1.0"?>{URDF}').joint_names == ("a", "b")


@pytest.mark.parametrize(
    "text",
    [
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="arm.xacro"/></robot>',
        '<robot name="r"><xacro:arm parent="base"/></robot>',
        URDF.replace('"0.1"', '"${mass}"'),
        URDF.replace('"0.1"', '"$(arg mass)"'),
    ],
)
def test_a_xacro_file_gets_told_what_to_do_first(text: str) -> None:
    with pytest.raises(InputError, match="run xacro first"):
        RigidBodyTree.from_urdf(text)


def test_a_urdf_made_by_xacro_is_none_any_more() -> None:
    made = URDF.replace("<robot ", '<!-- by xacro: do not edit --><robot xmlns:xacro="http://www.ros.org/wiki/xacro" ')
    assert RigidBodyTree.from_urdf(made).joint_names == ("a", "b")


@pytest.mark.skipif(not PUBLIC.is_dir(), reason="needs a folder of public robots beside the repository")
def test_95_of_100_public_robots_load() -> None:
    files = sorted(PUBLIC.glob("*.urdf"))
    refused = {}
    for file in files:
        try:
            RigidBodyTree.from_urdf(read_rig(file).text)
        except InputError as error:
            refused[file.name] = str(error)
    assert len(refused) <= 0.05 * len(files), refused


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
