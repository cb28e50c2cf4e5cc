"""The rigid-body tree against a physics engine and closed forms."""

import numpy as np
import pybullet
import pytest

from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import Mimic, RigidBodyTree
from tactile_cube.hand.rigid_body_equations import WORK_COLUMNS, add_spin_inertia, add_weight, mass_matrix_and_bias

INERTIAL = (
    '<inertial><origin xyz="{x} 0.01 -0.02" rpy="0.3 -0.2 0.5"/><mass value="{m:.2f}"/>'
    '<inertia ixx="4e-4" iyy="3e-4" izz="2e-4" ixy="2e-5" ixz="-1e-5" iyz="3e-5"/></inertial>'
)
LINKS = '<link name="base"/>' + "".join(
    f'<link name="l{k}">{INERTIAL.format(x=0.02 * k, m=0.1 + 0.05 * k)}</link>' for k in range(1, 7)
)
JOINT = (
    '<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
    '<origin xyz="0.05 -0.02 0.1" rpy="0.4 -0.3 0.8"/><axis xyz="{axis}"/>'
    '<limit lower="-9" upper="9" effort="9" velocity="9"/>{more}</joint>'
)


def joint(name: str, kind: str, parent: str, child: str, axis: str = "0 0 1", more: str = "") -> str:
    return JOINT.format(name=name, kind=kind, parent=parent, child=child, axis=axis, more=more)


def robot(*joints: str, links: str = LINKS) -> str:
    return f'<?xml version="1.0"?><robot name="r">{links}{"".join(joints)}</robot>'


BRANCHED = robot(
    joint("a", "revolute", "base", "l1", "1 2 3"),
    joint("b", "prismatic", "l1", "l2", "0 1 0"),
    joint("weld", "fixed", "l2", "l3"),
    joint("c", "continuous", "l3", "l4", "0.5 0 -1"),
    joint("d", "revolute", "l1", "l5", "0 1 1"),
    joint("e", "revolute", "l5", "l6", "1 0 0"),
)
GRAVITY = np.array([1.0, -2.0, -9.0])


def test_mass_matrix_and_bias_equal_those_of_a_physics_engine(tmp_path) -> None:
    tree = RigidBodyTree.from_urdf(BRANCHED)
    (tmp_path / "rig.urdf").write_text(BRANCHED)
    client = pybullet.connect(pybullet.DIRECT)
    body = pybullet.loadURDF(
        str(tmp_path / "rig.urdf"), useFixedBase=True, flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client
    )
    pybullet.setGravity(*GRAVITY, physicsClientId=client)
    infos = [pybullet.getJointInfo(body, k, physicsClientId=client) for k in range(6)]
    names = [info[1].decode() for info in infos if info[2] != pybullet.JOINT_FIXED]
    order = [names.index(name) for name in tree.dof_names]
    for q, v, a in np.random.default_rng(0).normal(size=(5, 3, 5)):
        M, h = tree.equations(q, v, GRAVITY)
        theirs = [np.empty(5) for _ in range(3)]
        for row, mine in zip(theirs, (q, v, a), strict=True):
            row[order] = mine
        lists = [row.tolist() for row in theirs]
        matrix = np.array(pybullet.calculateMassMatrix(body, lists[0], physicsClientId=client))
        torque = np.array(pybullet.calculateInverseDynamics(body, *lists, physicsClientId=client))
        np.testing.assert_allclose(M, matrix[np.ix_(order, order)], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(M @ a + h, torque[order], rtol=1e-9, atol=1e-12)
        (taken,) = tree.inverse_dynamics(q[None], v[None], a[None], GRAVITY)
        np.testing.assert_allclose(taken, torque[order], rtol=1e-9, atol=1e-12)
    pybullet.disconnect(client)


def test_double_pendulum_has_the_equations_of_the_textbook() -> None:
    inertial = '<inertial><origin xyz="0 0 {z}"/><mass value="{m}"/></inertial>'
    links = "".join(
        f'<link name="l{k}">{inertial.format(z=-length, m=m)}</link>' for k, length, m in ((1, 0.3, 0.5), (2, 0.2, 0.4))
    )
    text = robot(
        '<joint name="a" type="continuous"><parent link="base"/><child link="l1"/><axis xyz="0 -1 0"/></joint>',
        '<joint name="b" type="continuous"><parent link="l1"/><child link="l2"/><origin xyz="0 0 -0.3"/>'
        '<axis xyz="0 -1 0"/></joint>',
        links='<link name="base"/>' + links,
    )
    (q1, q2), (v1, v2) = (0.4, -0.9), (1.3, 0.7)
    l1, l2, m1, m2, g = 0.3, 0.2, 0.5, 0.4, 9.81
    M, h = RigidBodyTree.from_urdf(text).equations(np.array([q1, q2]), np.array([v1, v2]), np.array([0, 0, -g]))
    cross = m2 * l1 * l2 * np.cos(q2)
    corner = m2 * l2**2
    np.testing.assert_allclose(
        M, [[m1 * l1**2 + m2 * l1**2 + corner + 2 * cross, corner + cross], [corner + cross, corner]], rtol=1e-12
    )
    swirl, second = m2 * l1 * l2 * np.sin(q2), m2 * g * l2 * np.sin(q1 + q2)
    np.testing.assert_allclose(
        h, [-swirl * (2 * v1 * v2 + v2**2) + (m1 + m2) * g * l1 * np.sin(q1) + second, swirl * v1**2 + second]
    )


def test_fixed_joints_are_merged_into_the_link_before_them() -> None:
    tree = RigidBodyTree.from_urdf(BRANCHED)
    assert set(tree.dof_names) == {"a", "b", "c", "d", "e"}
    assert tree.mass[tree.dof_names.index("b")] == pytest.approx(0.2 + 0.25)
    assert tree.parent[tree.dof_names.index("c")] == tree.dof_names.index("b")


def test_a_mimic_joint_follows_its_leader() -> None:
    text = BRANCHED.replace('<axis xyz="1 0 0"/>', '<axis xyz="1 0 0"/><mimic joint="d" multiplier="2" offset="0.1"/>')
    tree = RigidBodyTree.from_urdf(text)
    assert tree.joint_names == ("a", "b", "c", "d")
    q = tree.expand(np.array([1.0, 2.0, 3.0, 4.0]))
    assert q[tree.dof_names.index("e")] == pytest.approx(8.1)
    assert tree.coupling[tree.dof_names.index("e")].tolist() == [0.0, 0.0, 0.0, 2.0]


def test_a_coupling_given_beside_the_urdf_does_the_same_as_mimic() -> None:
    mimic = BRANCHED.replace('<axis xyz="1 0 0"/>', '<axis xyz="1 0 0"/><mimic joint="d" multiplier="2" offset="0.1"/>')
    inside = RigidBodyTree.from_urdf(mimic)
    beside = RigidBodyTree.from_urdf(BRANCHED, coupled={"e": Mimic("d", 2.0, 0.1)})
    q = np.array([0.1, 0.2, 0.3, 0.4])
    assert np.array_equal(inside.actuated_mass_matrix(q), beside.actuated_mass_matrix(q))
    still = (q[None], 0.0 * q[None])
    free, pushed = (inside.inverse_dynamics(*still, a, np.zeros(3))[0] for a in (0.0 * q[None], q[None]))
    np.testing.assert_allclose(pushed - free, inside.actuated_mass_matrix(q) @ q, rtol=1e-12)


def test_joints_are_ordered_as_asked_and_the_others_are_locked() -> None:
    tree = RigidBodyTree.from_urdf(BRANCHED, joints=("c", "a"))
    full = RigidBodyTree.from_urdf(BRANCHED)
    q = np.zeros(5)
    q[full.dof_names.index("a")], q[full.dof_names.index("c")] = 0.3, -0.7
    M, _ = full.equations(q, np.zeros(5), GRAVITY)
    pick = [full.dof_names.index("c"), full.dof_names.index("a")]
    np.testing.assert_allclose(tree.actuated_mass_matrix(np.array([-0.7, 0.3])), M[np.ix_(pick, pick)], rtol=1e-12)


def test_spin_inertia_equals_a_link_with_that_inertia_about_its_axis() -> None:
    plain = RigidBodyTree.from_urdf(BRANCHED)
    spin = np.array([1e-3, 0.0, 2e-3, 3e-3, 4e-3])
    inertia = plain.inertia + spin[:, None, None] * (1 - plain.prismatic)[:, None, None] * np.einsum(
        "ki,kj->kij", plain.axis, plain.axis
    )
    q, v = np.random.default_rng(1).normal(size=(2, 5))
    M, h, work = np.zeros((5, 5)), np.zeros(5), np.zeros((6, WORK_COLUMNS))
    shape = (plain.parent, plain.prismatic, plain.placement_rotation, plain.placement_translation, plain.axis)
    mass_matrix_and_bias(*shape, plain.mass, plain.com, plain.inertia, q, v, GRAVITY, work, M, h)
    add_spin_inertia(plain.parent, plain.prismatic, spin, work, M, h)
    expected_M, expected_h = np.zeros((5, 5)), np.zeros(5)
    mass_matrix_and_bias(
        *shape, plain.mass, plain.com, inertia, q, v, GRAVITY, np.zeros((6, WORK_COLUMNS)), expected_M, expected_h
    )
    np.testing.assert_allclose(M, expected_M, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(h, expected_h, rtol=1e-12, atol=1e-15)


def test_changing_gravity_afterwards_equals_computing_with_it() -> None:
    tree = RigidBodyTree.from_urdf(BRANCHED)
    q, v = np.random.default_rng(2).normal(size=(2, 5))
    other = np.array([0.3, 0.0, -1.0])
    M, h, work = np.zeros((5, 5)), np.zeros(5), np.zeros((6, WORK_COLUMNS))
    numbers = (tree.placement_rotation, tree.placement_translation, tree.axis, tree.mass, tree.com, tree.inertia)
    mass_matrix_and_bias(tree.parent, tree.prismatic, *numbers, q, v, GRAVITY, work, M, h)
    add_weight(tree.parent, tree.prismatic, tree.mass, GRAVITY, other, work, h)
    np.testing.assert_allclose(h, tree.equations(q, v, other)[1], rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize(
    ("text", "options", "complaint"),
    [
        ("<robot", {}, "not well-formed"),
        ("<sdf/>", {}, "<sdf>"),
        (robot(joint("a", "ball", "base", "l1")), {}, "type 'ball'"),
        (robot(joint("a", "revolute", "base", "l9")), {}, "'l9'"),
        (robot(joint("a", "revolute", "base", "l1", "0 0 0")), {}, "axis of joint 'a' is zero"),
        (robot(joint("a", "revolute", "base", "l1", "0 x 0")), {}, "three numbers"),
        (robot(joint("a", "fixed", "base", "l1"), links='<link name="base"/><link name="l1"/>'), {}, "no joint"),
        (robot(joint("a", "revolute", "base", "l1")), {}, "one root link"),
        (robot(joint("a", "revolute", "base", "l1"), joint("b", "revolute", "l2", "l1")), {}, "more than one parent"),
        (BRANCHED.replace('"0.15"', '"-1"'), {}, "mass -1"),
        (BRANCHED.replace('"0.15"', '"heavy"'), {}, 'value="heavy"'),
        (BRANCHED, {"joints": ("a", "q7")}, "no movable joint 'q7'"),
        (BRANCHED, {"joints": ("a", "a")}, "twice"),
        (BRANCHED, {"coupled": {"q7": Mimic("a")}}, "no movable joint 'q7'"),
        (BRANCHED, {"joints": ("a", "b"), "coupled": {"b": Mimic("a")}}, "choose one"),
        (BRANCHED, {"coupled": {"b": Mimic("c"), "c": Mimic("a")}}, "'b' follows 'c'"),
    ],
)
def test_an_unusable_urdf_is_refused_with_one_line_that_names_the_fault(text, options, complaint) -> None:
    with pytest.raises(InputError, match=complaint) as error:
        RigidBodyTree.from_urdf(text, **options)
    assert "\n" not in str(error.value)
