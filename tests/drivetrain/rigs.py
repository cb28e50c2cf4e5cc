"""Small mechanisms with equations that can be written down."""

from tactile_cube.hand.rigid_body import RigidBodyTree

_LINK = (
    '<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>'
    '<inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
_JOINT = (
    '<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
    '<origin xyz="{origin}"/><axis xyz="{axis}"/>{more}</joint>'
)


def wheel(inertia: float = 4e-3) -> RigidBodyTree:
    """One joint `q` about a vertical axis: no gravity, inertia [kg m^2]."""
    link = _LINK.format(name="rim", com="0 0 0", mass=0.1, i=inertia)
    joint = _JOINT.format(name="q", parent="base", child="rim", origin="0 0 0", axis="0 0 1", more="")
    return RigidBodyTree.from_urdf(f'<robot name="wheel"><link name="base"/>{link}{joint}</robot>')


def pendulum(length: float = 0.1, mass: float = 0.2) -> RigidBodyTree:
    """One joint `q`, a point mass hanging below it."""
    link = _LINK.format(name="bob", com=f"0 0 {-length}", mass=mass, i=0)
    joint = _JOINT.format(name="q", parent="base", child="bob", origin="0 0 0", axis="0 1 0", more="")
    return RigidBodyTree.from_urdf(f'<robot name="pendulum"><link name="base"/>{link}{joint}</robot>')


def pendulums() -> RigidBodyTree:
    """Joints `a`, `b`, `c` side by side and one that follows `c`: each 0.2 kg at 0.1 m, 4e-3 kg m^2 about its axis."""
    text = ""
    for name, more in (("a", ""), ("b", ""), ("c", ""), ("d", '<mimic joint="c"/>')):
        text += _LINK.format(name=f"bob_{name}", com="0 0 -0.1", mass=0.2, i=2e-3)
        text += _JOINT.format(name=name, parent="base", child=f"bob_{name}", origin="0 0 0", axis="0 1 0", more=more)
    return RigidBodyTree.from_urdf(f'<robot name="pendulums"><link name="base"/>{text}</robot>')


def finger_text(distal_mass: float = 0.035) -> str:
    """A finger q1, q2, q3 with q4 = q3, hanging down."""
    sizes = (("knuckle", 0.0, 0.04), ("proximal", 0.0366, 0.11), ("middle", 0.0177, 0.055))
    links = [_LINK.format(name=name, com=f"0 0 {-com}", mass=mass, i=2e-5) for name, com, mass in sizes]
    links.append(_LINK.format(name="distal", com="0 0 -0.0202", mass=distal_mass, i=8e-6))
    chain = (
        ("q1", "base", "knuckle", "0 0 0", "1 0 0", ""),
        ("q2", "knuckle", "proximal", "0 0 0", "0 1 0", ""),
        ("q3", "proximal", "middle", "0 0 -0.075", "0 1 0", ""),
        ("q4", "middle", "distal", "0 0 -0.04", "0 1 0", '<mimic joint="q3"/>'),
    )
    keys = ("name", "parent", "child", "origin", "axis", "more")
    joints = [_JOINT.format(**dict(zip(keys, row, strict=True))) for row in chain]
    return f'<robot name="finger"><link name="base"/>{"".join(links + joints)}</robot>'


def finger(distal_mass: float = 0.035) -> RigidBodyTree:
    """The finger of `finger_text`."""
    return RigidBodyTree.from_urdf(finger_text(distal_mass))
