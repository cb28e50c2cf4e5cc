"""MJCF files against MuJoCo itself, and those that ask for what is not theirs."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.hand.mjcf import read_mjcf
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.measurement.recordings.rig import read_rig

ARM = """<mujoco><compiler angle="radian"/><default><default class="small"><joint armature="0.02"/></default></default>
<worldbody><light pos="0 0 3"/><body name="upper" pos="0.1 0 0.2" euler="0.2 0.1 0.3">
<joint name="swing" class="small" axis="0 1 0" pos="0.01 0.02 0" ref="0.3" range="-1 1" damping="0.1"/>
<joint name="roll &amp; tilt" axis="1 0 0" pos="0 0.02 0.03"/>
<geom type="capsule" size="0.02 0.1" pos="0.1 0 0"/><site name="s"/>
<body name="lower" pos="0 0 0.3" quat="1 0.2 0.1 0"><joint name="slide" type="slide" axis="0 0 1" ref="0.05"
frictionloss="0.2"/><geom type="box" size="0.02 0.1 0.03" pos="0.1 0 0.1"/><body pos="0.1 0.1 0"><geom size="0.05"/>
<body pos="0.1 0 0"><joint name="last" axis="0 0 1"/><geom size="0.03" pos="0.05 0 0"/></body></body></body></body>
</worldbody>MORE</mujoco>"""
DRIVES = """<actuator><position joint="swing" kp="5" kv="0.3" gear="2" armature="0.01"/>
<motor name="m" joint="roll &amp; tilt" forcerange="-2 2" delay="0.01" nsample="9"/>
<velocity joint="slide"/></actuator>"""
FOLLOWS = '<equality><joint joint1="last" joint2="swing" polycoef="0.1 0.5 0 0 0"/></equality>'


def written(folder: Path, text: str, name: str = "arm.xml") -> Path:
    (folder / name).write_text(text)
    return folder / name


def test_the_mechanism_has_mujocos_equations_of_motion(tmp_path: Path) -> None:
    file = written(tmp_path, ARM.replace("MORE", DRIVES))
    found = read_mjcf(file)
    tree, model = RigidBodyTree.from_urdf(found.urdf), mujoco.MjModel.from_xml_path(str(file))
    q, v = np.random.default_rng(0).uniform(-0.5, 0.5, (2, tree.dofs))
    data, expected = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    for name, position, speed in zip(tree.dof_names, q, v, strict=True):
        data.joint(name).qpos[:], data.joint(name).qvel[:] = position, speed
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, expected)
    order = [model.joint(name).dofadr[0] for name in tree.dof_names]
    M, bias = tree.equations(q, v, model.opt.gravity)
    rotors = np.diag([found.stated["reflected_inertia"][name] for name in tree.dof_names])
    np.testing.assert_allclose(M + rotors, expected[np.ix_(order, order)], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(bias, data.qfrc_bias[order], rtol=1e-9, atol=1e-10)


def test_drives_are_stated_as_at_the_joint_and_what_has_no_place_is_said(tmp_path: Path) -> None:
    found = read_mjcf(written(tmp_path, ARM.replace("MORE", DRIVES)))
    assert found.stated["kp"] == {"swing": pytest.approx(20.0)}
    assert found.stated["kd"] == {"swing": pytest.approx(1.2)}
    assert found.stated["torque_limit"]["roll & tilt"] == 2.0
    assert found.stated["reflected_inertia"]["swing"] == pytest.approx(0.06)
    assert found.stated["static_friction"]["slide"] == 0.2
    assert found.stated["viscous_friction"]["swing"] == 0.1
    said = "\n".join(found.left_out)
    assert all(word in said for word in ("gear of 2", "delay of 0.01 s", "neither a motor nor a position actuator"))


def test_a_joint_tied_to_another_one_follows_it(tmp_path: Path) -> None:
    file = written(tmp_path, ARM.replace("MORE", FOLLOWS))
    tree, model = RigidBodyTree.from_urdf(read_mjcf(file).urdf), mujoco.MjModel.from_xml_path(str(file))
    data, q = mujoco.MjData(model), tree.expand(np.array([0.4, 0.1, 0.2]))
    for name, position in zip(tree.dof_names, q, strict=True):
        data.joint(name).qpos[:] = position
    mujoco.mj_forward(model, data)
    assert np.abs(data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]).max() < 1e-9


def test_a_base_that_floats_is_held_and_said(tmp_path: Path) -> None:
    base = '<body name="b"><freejoint name="free"/><geom size="0.1"/><body name="upper" '
    text = ARM.replace("MORE", "").replace('<body name="upper" ', base).replace("</worldbody>", "</body></worldbody>")
    tree = RigidBodyTree.from_urdf(read_rig(written(tmp_path, text)).text)
    assert tree.corrected == ("joint 'free' is floating; its link 'b' is held",)
    assert tree.joint_names[0] == "swing"


def test_includes_are_read_and_meshes_that_no_inertia_needs_are_not(tmp_path: Path) -> None:
    body = '<body name="b"><joint name="j" axis="0 1 0"/><inertial pos="0 0 1" mass="2" diaginertia="1 1 1"/>'
    written(tmp_path, f'<mujocoinclude>{body}<geom type="mesh" mesh="lost"/></body></mujocoinclude>', "part.xml")
    asset = '<asset><mesh name="lost" file="lost.stl"/><texture file="/etc/passwd" type="2d"/></asset>'
    found = read_mjcf(written(tmp_path, f'<mujoco>{asset}<worldbody><include file="part.xml"/></worldbody></mujoco>'))
    assert RigidBodyTree.from_urdf(found.urdf).mass.tolist() == [2.0]


def with_mesh(file: str, compiler: str = "") -> str:
    return f'<mujoco>{compiler}<asset><mesh name="m" file="{file}"/></asset>{BODY}</mujoco>'


BODY = '<worldbody><body><joint/><geom type="mesh" mesh="m"/></body></worldbody>'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('<mujoco><include file="../secret.xml"/></mujoco>', "lies outside of"),
        ('<mujoco><include file="/etc/hostname"/></mujoco>', "lies outside of"),
        ('<mujoco><include file="lost.xml"/></mujoco>', "lost.xml: no such file"),
        ('<mujoco><include file="arm.xml"/></mujoco>', "included twice"),
        (with_mesh("../secret.stl"), "lies outside of"),
        (with_mesh("a.stl", '<compiler meshdir="/etc"/>'), "lies outside of"),
        (with_mesh("lost.stl"), "no such file"),
        (with_mesh("arm.xml"), "convert it to .obj or .stl"),
        ('<mujoco><asset><model name="m" file="x.xml"/></asset><worldbody><attach model="m"/></worldbody></mujoco>',
         "<attach> is not read"),
        ('<!DOCTYPE m [<!ENTITY a SYSTEM "../secret.xml">]><mujoco>&a;<worldbody/></mujoco>', "not well-formed XML"),
        ("<mujoco><worldbody>" + "<body>" * 3000 + "</body>" * 3000 + "</worldbody></mujoco>", "nested too deeply"),
        ("<mujoco><worldbody>" + "<body>" * 800 + "</body>" * 800 + "</worldbody></mujoco>", "does not read it"),
        ('<mujoco><worldbody><body><joint/><geom size="1" mass="nan"/></body></worldbody></mujoco>', 'mass="nan"'),
        ('<mujoco><worldbody><body><joint/><geom size="1" mass="-1"/></body></worldbody></mujoco>', "mass"),
        ("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "MuJoCo does not read it: Error: mass"),
        ("<mujoco><worldbody><body></worldbody></mujoco>", "not well-formed XML"),
    ],
)  # fmt: skip
def test_what_no_mjcf_may_ask_for_is_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "own").mkdir()
    for name in ("secret.xml", "secret.stl"):
        (tmp_path / name).write_text("<mujoco/>")
    with pytest.raises(InputError, match=said) as error:
        read_rig(written(tmp_path / "own", text))
    assert "\n" not in str(error.value)
    assert "arm.xml" in str(error.value) or "lost" in str(error.value)
