import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.hand import Hand, hand_from_urdf, tip_positions
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.hand.urdf_hand import DESCRIPTIONS
from tests.meshes import CUBE, write_obj
from tests.own_hands import description, own_hand

TEXT = (DESCRIPTIONS / "three_finger.urdf").read_text()


def written(folder: Path, text: str) -> str:
    file = folder / "own.urdf"
    file.write_text(text)
    return str(file)


def test_numbers_of_fingers_and_joints_follow_from_the_description() -> None:
    hand = own_hand("left", "right")
    assert (len(hand.fingers), hand.joints_per_finger, hand.joints) == (2, 4, 8)
    assert hand.joint_names[3:5] == ("left_q4", "right_q1")
    assert hand.action_lower.shape == hand.start_angles.shape == (8,)


def test_fingertips_start_a_millimetre_off_the_cube() -> None:
    hand = own_hand()
    left, right, thumb = tip_positions(hand, hand.start_angles)
    gap = hand.tip_radius + 1e-3
    assert left[1] == pytest.approx(-0.04 - gap, abs=1e-5)
    assert (right[0], thumb[0]) == pytest.approx((0.04 + gap, -0.04 - gap), abs=1e-5)


def test_turned_link_frames_leave_tips_and_masses_where_the_urdf_has_them() -> None:
    """The same finger from the file as it is, and cut out with joint axes along z."""
    hand, q = own_hand(), np.array([0.3, -0.2, 0.7, 0.4])
    straight = tip_positions(hand, np.zeros(12))[1]
    np.testing.assert_allclose(straight, [0.053694, 0.031, -0.02], atol=1e-6)
    original = RigidBodyTree.from_urdf(TEXT, ["right_q1", "right_q2", "right_q3", "right_q4"])
    cut = RigidBodyTree.from_urdf(hand.finger_urdf(1))
    gravity = np.array([0.0, 0.0, -9.81])
    mass, bias = original.equations(q, 0.5 * q, gravity)
    same_mass, same_bias = cut.equations(q, 0.5 * q, hand.base_in_world(1)[1].T @ gravity)
    np.testing.assert_allclose(same_mass, mass, atol=1e-10)
    np.testing.assert_allclose(same_bias, bias, atol=1e-10)


def test_the_whole_hand_has_the_fingers_joints() -> None:
    hand = own_hand()
    tree = RigidBodyTree.from_urdf(hand.urdf())
    assert tree.joint_names == hand.joint_names
    assert [hand.followed(name) for name in tree.joint_names] == list(hand.joint_names)


def test_a_joint_that_mimics_another_is_coupled(tmp_path: Path) -> None:
    text = TEXT
    for finger in ("left", "right", "thumb"):
        mark = f'<parent link="{finger}_middle"/>'
        assert mark in text
        text = text.replace(mark, f'<mimic joint="{finger}_q3"/>{mark}')
    fingers = {name: one | {"joints": one["joints"][:3]} for name, one in description()["fingers"].items()}
    action = {"lower": [-0.7, -0.6, -0.05], "upper": [0.7, 0.6, 1.0]}
    hand = own_hand(urdf=written(tmp_path, text), fingers=fingers, action=action)
    assert (hand.joints, hand.links_per_finger, hand.coupled()) == (9, 4, ((3, 2),))
    assert hand.followed("thumb_q4") == "thumb_q3"
    np.testing.assert_array_equal(hand.all_angles(np.arange(9.0))[1], [3.0, 4.0, 5.0, 5.0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"urdf": "nowhere.urdf"}, "hand.urdf=nowhere.urdf: no such file"),
        ({"urdf": "/dev/zero"}, "/dev/zero: is a device; a regular file is needed here"),
        ({"tip_radius": -0.01}, "hand.tip_radius is -0.01; give a radius above 0"),
        ({"start": [9.0] * 12}, "hand.start: left_q1 at 9 rad, its limits are"),
        ({"action": {"lower": [0.1], "upper": [0.2]}}, "hand.action.lower has 1 numbers; give 4"),
        ({"start": [0.0]}, "hand.start has 1 angles; the hand has 12 joints"),
        ({"position": [0.0, 1.0]}, "hand.position is"),
    ],
)
def test_what_does_not_fit_is_said_by_its_key(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message.replace("[", r"\[")):
        own_hand(**changes)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("tip", "right_tip", "left.tip is 'right_tip', no link that joint 'left_q4' carries"),
        ("tip", "nothing", "left.tip is 'nothing'"),
        ("joints", ["left_q2", "left_q1", "left_q3", "left_q4"], "list a chain, from the palm to the tip"),
        ("joints", ["left_q1", "left_q2", "left_q3"], "different joints"),
        ("side", [0.0, 0.0, 1.0], "give a horizontal direction"),
    ],
)
def test_a_finger_that_does_not_fit_is_named(key: str, value: Any, message: str) -> None:
    plain = description()
    plain["fingers"]["left"] = plain["fingers"]["left"] | {key: value}
    if message == "different joints":
        plain["fingers"]["left"]["tip"] = "left_tip"
    with pytest.raises(InputError, match=message):
        hand_from_urdf(**plain)


def test_limits_that_leave_no_room_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"joint 'left_q\d' has the limits \S+ to -\S+ rad"):
        own_hand(urdf=written(tmp_path, TEXT.replace('upper="', 'upper="-')))


def test_a_joint_without_limits_is_refused(tmp_path: Path) -> None:
    text = TEXT.replace('<joint name="left_q2" type="revolute">', '<joint name="left_q2" type="continuous">')
    with pytest.raises(InputError, match="joint 'left_q2' has no limits"):
        own_hand(urdf=written(tmp_path, text))


MATERIAL = "newmtl m\nmap_Kd -bm 1 {}\n"


def with_mesh(folder: Path, name: str) -> Hand:
    """The pattern in `folder/hand/urdf` with a mesh as a finger's shape; there are meshes in and outside of `hand`."""
    inner = folder / "hand" / "urdf"
    inner.mkdir(parents=True)
    for place in (folder, inner, folder / "hand"):
        write_obj(place, 0.01 * CUBE)
    (folder / "picture.png").write_bytes(b"secret")
    for file, part in (("own", "tile.png"), ("far", "../../picture.png"), ("pipe", str(folder / "picture.png"))):
        (inner / f"{file}.mtl").write_text(MATERIAL.format(part))
        (inner / f"{file}.obj").write_text(f"mtllib {file}.mtl\n" + (folder / "object.obj").read_text())
    (inner / "out.obj").write_text("mtllib ../../picture.png\n" + (folder / "object.obj").read_text())
    (inner / "link.obj").symlink_to(folder / "object.obj")
    (inner / "mesh.dae").write_text("<COLLADA/>")
    os.mkfifo(inner / "pipe.stl")
    shape = f'<collision><geometry><mesh filename="{name.format(folder)}"/></geometry></collision>'
    drawn = '<visual><geometry><mesh filename="/nowhere/drawn.dae"/></geometry></visual>'
    text = TEXT.replace('<link name="left_distal">', f'<link name="left_distal">{drawn}{shape}')
    assert text != TEXT
    return own_hand(urdf=written(inner, text))


@pytest.mark.parametrize("name", ["object.obj", "own.obj", "package://any/object.obj", "file://object.obj"])
def test_a_mesh_below_the_urdf_is_taken(tmp_path: Path, name: str) -> None:
    file = tmp_path / "hand" / "urdf" / name.rpartition("/")[2]
    assert [shape.file for shape in with_mesh(tmp_path, name).fingers[0].shapes[-1] if shape.file] == [str(file)]


@pytest.mark.parametrize("name", ["../object.obj", "package://any/object.obj"])
def test_a_package_xml_above_the_urdf_says_what_its_folder_is(tmp_path: Path, name: str) -> None:
    (tmp_path / "hand").mkdir()
    (tmp_path / "hand" / "package.xml").touch()
    file = str(tmp_path / "hand" / "object.obj")
    assert [shape.file for shape in with_mesh(tmp_path, name).fingers[0].shapes[-1] if shape.file] == [file]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("{}/object.obj", "lies outside of"),
        ("file://{}/object.obj", "lies outside of"),
        ("../object.obj", "lies outside of"),
        ("package://../../object.obj", "lies outside of"),
        ("package://any/../../object.obj", "lies outside of"),
        ("link.obj", "lies outside of"),
        ("out.obj", "out.obj: '../../picture.png' lies outside of"),
        ("far.obj", "far.mtl: '../../picture.png' lies outside of"),
        ("pipe.obj", "pipe.mtl: '/.*/picture.png' lies outside of"),
        ("pipe.stl", "pipe.stl: is a pipe"),
        ("/dev/zero", "lies outside of"),
        ("none.stl", "none.stl: no such file"),
        ("mesh.dae", "convert it to .obj or .stl"),
    ],
)
def test_a_mesh_from_elsewhere_is_refused(tmp_path: Path, name: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as error:
        with_mesh(tmp_path, name)
    assert "\n" not in str(error.value)
