"""One finger of any URDF, cut out as a chain whose links have their joint's axis along z."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

from tactile_cube.errors import InputError
from tactile_cube.hand.chain import Chain
from tactile_cube.hand.hand import Finger
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.hand.urdf import Array, CollisionShape, origin_element
from tactile_cube.hand.urdf_elements import Placement, number, placement_of, triple
from tactile_cube.hand.urdf_tree import require_mesh


def read_shapes(robot: ElementTree.Element, tree: RigidBodyTree, carrier: int, turn: Array) -> list[CollisionShape]:
    """Collision shapes of all links that move with a dof.

    Args:
        robot: root element of a URDF whose files have absolute names.
        tree: read from it.
        carrier: the dof, -1 for what does not move.
        turn: axes to see the shapes from, in the dof's frame (3, 3).

    Raises:
        InputError: a shape that no engine has, a mesh that none reads.
    """
    shapes = []
    for link in robot.findall("link"):
        name = str(link.get("name"))
        dof, place = tree.homes[name]
        for collision in link.findall("collision") if dof == carrier else ():
            geometry, where = collision.find("geometry"), f"link '{name}'"
            kinds = list(geometry) if geometry is not None else []
            if len(kinds) != 1:
                raise InputError(f"URDF: a <collision> of {where} has {len(kinds)} geometries; give one")
            at = place.then(placement_of(collision, where))
            seen = Placement(turn.T @ at.rotation, turn.T @ at.translation)
            shapes.append(_shape(kinds[0], seen, where))
    return shapes


def _shape(element: ElementTree.Element, at: Placement, where: str) -> CollisionShape:
    kind = element.tag
    if kind == "box":
        return CollisionShape("box", tuple(triple(element, "size", where).tolist()), at.translation, at.rotation)
    if kind == "sphere":
        return CollisionShape("sphere", (number(element, "radius", where, 0.0),), at.translation, at.rotation)
    if kind == "cylinder" or kind == "capsule":
        size = (number(element, "radius", where, 0.0), number(element, "length", where, 0.0))
        return CollisionShape("cylinder" if kind == "cylinder" else "capsule", size, at.translation, at.rotation)
    if kind == "mesh":
        scale = tuple(triple(element, "scale", where).tolist()) if element.get("scale") else (1.0, 1.0, 1.0)
        file = Path(element.get("filename", ""))
        require_mesh(file, where)
        return CollisionShape("mesh", scale, at.translation, at.rotation, str(file))
    raise InputError(f"URDF: {where} has the shape <{kind}>; use box, sphere, cylinder, capsule or mesh")


def read_finger(
    text: str, name: str, joints: tuple[str, ...], tip: str, face: Array, where: str
) -> tuple[Finger, tuple[int, ...]]:
    """Cut a finger out of a URDF.

    Products of inertia about a joint's axis are left out: beside the rotor's inertia, which acts there, they vanish.

    Args:
        text: the URDF, in which files have absolute names.
        name: of the finger.
        joints: its actuated joints, from the palm to the tip.
        tip: link whose origin is the middle of the fingertip.
        face: see `Finger`.
        where: what to call the finger in errors.

    Returns:
        The finger, and the actuated joint that each of its joints moves with.

    Raises:
        InputError: joints that form no chain of revolute joints, a tip elsewhere, links without mass.
    """
    tree = RigidBodyTree.from_urdf(text, joints)
    _require_chain(tree, joints, where)
    last, tip_place = tree.homes.get(tip, (-1, Placement()))
    if last != tree.dofs - 1:
        raise InputError(f"{where}.tip is '{tip}', no link that joint '{tree.dof_names[-1]}' carries; name one")
    robot = ElementTree.fromstring(text)
    turns = [_principal(tree.axis[k], tree.inertia[k]) for k in range(tree.dofs)]
    before = [np.eye(3), *turns]
    rotations = [before[k].T @ tree.placement_rotation[k] @ turns[k] for k in range(tree.dofs)]
    translations = [before[k].T @ tree.placement_translation[k] for k in range(tree.dofs)]
    columns = tuple(int(column) for column in tree.follow)
    finger = Finger(
        name=name,
        position=translations[0],
        rotation=rotations[0],
        face=face,
        joints=tree.dof_names,
        links=tree.link_names,
        limits=np.stack([tree.lower, tree.upper], axis=1),
        origins=tuple(map(origin_element, translations[1:], rotations[1:])),
        mass=tree.mass,
        com=np.stack([turn.T @ com for turn, com in zip(turns, tree.com, strict=True)]),
        inertia=np.stack([np.diag(turn.T @ own @ turn) for turn, own in zip(turns, tree.inertia, strict=True)]),
        shapes=tuple(tuple(read_shapes(robot, tree, k, turn)) for k, turn in enumerate(turns)),
        chain=Chain(np.array(rotations[1:]), np.array(translations[1:]), columns, turns[-1].T @ tip_place.translation),
    )
    return finger, columns


def _require_chain(tree: RigidBodyTree, joints: tuple[str, ...], where: str) -> None:
    actuated = tuple(name for k, name in enumerate(tree.dof_names) if name in joints)
    if list(tree.parent) != list(range(-1, tree.dofs - 1)) or actuated != joints:
        raise InputError(f"{where}.joints are {', '.join(joints)}; list a chain, from the palm to the tip")
    for k, name in enumerate(tree.dof_names):
        if tree.prismatic[k]:
            raise InputError(f"{where}: joint '{name}' slides; fingers have revolute joints")
        if not np.all(np.isfinite([tree.lower[k], tree.upper[k]])):
            raise InputError(f"{where}: joint '{name}' has no limits; give it <limit lower= upper=> [rad]")
        if not tree.lower[k] < tree.upper[k]:
            raise InputError(
                f"{where}: joint '{name}' has the limits {tree.lower[k]:g} to {tree.upper[k]:g} rad; lower < upper"
            )
        if not (tree.ratio[k] == 1.0 and tree.offset[k] == 0.0):
            raise InputError(
                f"{where}: joint '{name}' follows another with a ratio other than 1; that is not simulated"
            )
        if not tree.mass[k] > 0.0:
            raise InputError(f"{where}: what joint '{name}' carries has no mass; give its link <inertial>")


def _principal(axis: Array, inertia: Array) -> Array:
    """Axes (3, 3) of which z is `axis` (3,) and x, y are principal for `inertia` (3, 3) seen along it."""
    least = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(least, axis)
    x /= np.linalg.norm(x)
    frame = np.stack([x, np.cross(axis, x), axis], axis=1)
    seen = frame.T @ inertia @ frame
    angle = 0.5 * np.arctan2(2.0 * seen[0, 1], seen[0, 0] - seen[1, 1])
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(frame @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))
