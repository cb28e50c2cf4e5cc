"""One finger of any URDF, cut out as a chain whose links have their joint's axis along z."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_cube.errors import InputError
from tactile_cube.hand.chain import Chain
from tactile_cube.hand.hand import Array, CollisionShape
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.hand.urdf import number_list, origin_element
from tactile_cube.hand.urdf_elements import Placement, number, placement_of, triple
from tactile_cube.hand.urdf_tree import require_mesh


def read_shapes(link: ElementTree.Element, place: Placement) -> list[CollisionShape]:
    """Collision shapes of a link whose frame sits at `place`, in the frame that `place` is given in.

    Args:
        link: element of a URDF whose files have absolute names.
        place: where its frame is.

    Raises:
        InputError: a shape that no engine has, a mesh that none reads.
    """
    found, where = [], f"link '{link.get('name')}'"
    for collision in link.findall("collision"):
        geometry = collision.find("geometry")
        kinds = list(geometry) if geometry is not None else []
        if len(kinds) != 1:
            raise InputError(f"URDF: a <collision> of {where} has {len(kinds)} geometries; give one")
        at = place.then(placement_of(collision, where))
        found.append(_shape(kinds[0], at, where))
    return found


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


def collision_element(shape: CollisionShape) -> str:
    """A shape as URDF's <collision>."""
    return f"<collision>{origin_element(shape.position, shape.rotation)}{_geometry(shape)}</collision>"


def visual_elements(shape: CollisionShape, material: str) -> str:
    """A shape as <visual> elements that every reader can draw: a capsule as a cylinder and two spheres."""
    if shape.kind != "capsule":
        return f"<visual>{origin_element(shape.position, shape.rotation)}{_geometry(shape)}{material}</visual>"
    radius, length = shape.size
    along = 0.5 * length * shape.rotation[:, 2]
    parts = [
        CollisionShape("cylinder", (radius, length), shape.position, shape.rotation),
        *(CollisionShape("sphere", (radius,), shape.position + end, np.eye(3)) for end in (along, -along)),
    ]
    return "".join(visual_elements(part, material) for part in parts)


def _geometry(shape: CollisionShape) -> str:
    size = [f"{value:.10g}" for value in shape.size]
    inside = {
        "box": f'<box size="{" ".join(size)}"/>',
        "sphere": f'<sphere radius="{size[0]}"/>',
        "cylinder": f'<cylinder radius="{size[0]}" length="{size[-1]}"/>',
        "capsule": f'<capsule radius="{size[0]}" length="{size[-1]}"/>',
        "mesh": f'<mesh filename="{shape.file}" scale="{" ".join(size)}"/>',
    }
    return f"<geometry>{inside[shape.kind]}</geometry>"


def moved(shape: CollisionShape, rotation: Array) -> CollisionShape:
    """A shape seen from axes that are turned by `rotation` (3, 3) in those it is given in."""
    return CollisionShape(shape.kind, shape.size, rotation.T @ shape.position, rotation.T @ shape.rotation, shape.file)


_COLOURS = ("0.72 0.74 0.78 1", "0.13 0.15 0.18 1")
"""Of links and of the last one."""


@dataclass(frozen=True)
class UrdfFinger:
    """A chain of L revolute joints, of which J are actuated.

    Attributes:
        joints: names of its joints (L).
        links: names of the links they carry (L).
        columns: the actuated joint that each joint moves with (L,).
        limits: of the joints (L, 2) [rad].
        base: frame of the first joint in the root link of the URDF.
        places: frame of each further joint in that of the joint before it (L - 1).
        mass: of the links (L,) [kg].
        com: their centres of mass (L, 3) [m].
        inertia: their principal moments, about the frame's axes (L, 3) [kg m^2].
        shapes: what can be touched of each link.
        tip: middle of the fingertip in the last link's frame (3,) [m].
    """

    joints: tuple[str, ...]
    links: tuple[str, ...]
    columns: tuple[int, ...]
    limits: Array
    base: Placement
    places: tuple[Placement, ...]
    mass: Array
    com: Array
    inertia: Array
    shapes: tuple[tuple[CollisionShape, ...], ...]
    tip: Array

    def chain(self, position: Array, rotation: Array) -> Chain:
        """Its kinematics with the base at a place in the world."""
        rotations = [rotation, *(place.rotation for place in self.places)]
        translations = [position, *(place.translation for place in self.places)]
        return Chain(np.array(rotations), np.array(translations), self.columns, self.tip)

    def parts(self, parent: str, base: str) -> str:
        """Its links and joints as URDF, below the link `parent` at `base`, an origin element."""
        origins = [base, *(origin_element(place.translation, place.rotation) for place in self.places)]
        parents = [parent, *self.links]
        return "\n".join(self._link(k) + self._joint(k, parents[k], origins[k]) for k in range(len(self.links)))

    def _link(self, k: int) -> str:
        ixx, iyy, izz = (f"{value:.10g}" for value in self.inertia[k])
        inertia = f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/>'
        centre = f'<origin xyz="{number_list(self.com[k])}"/>'
        name = self.links[k]
        colour = f'<material name="{name}"><color rgba="{_COLOURS[k == len(self.links) - 1]}"/></material>'
        drawn = "".join(collision_element(shape) + visual_elements(shape, colour) for shape in self.shapes[k])
        inertial = f'<inertial>{centre}<mass value="{self.mass[k]:.10g}"/>{inertia}</inertial>'
        return f'<link name="{name}">{inertial}{drawn}</link>'

    def _joint(self, k: int, parent: str, origin: str) -> str:
        leader = self.columns.index(self.columns[k])
        mimic = "" if leader == k else f'<mimic joint="{self.joints[leader]}" multiplier="1" offset="0"/>'
        lower, upper = self.limits[k]
        ends = f'<parent link="{parent}"/><child link="{self.links[k]}"/>{origin}<axis xyz="0 0 1"/>'
        limit = f'<limit lower="{lower:.10g}" upper="{upper:.10g}" effort="10" velocity="50"/>'
        return f'<joint name="{self.joints[k]}" type="revolute">{ends}{limit}{mimic}</joint>'


def read_finger(text: str, joints: tuple[str, ...], tip: str, where: str) -> UrdfFinger:
    """Cut a finger out of a URDF.

    Products of inertia about a joint's axis are left out: beside the rotor's inertia, which acts there, they vanish.

    Args:
        text: the URDF, in which files have absolute names.
        joints: its actuated joints, from the palm to the tip.
        tip: link whose origin is the middle of the fingertip.
        where: what to call the finger in errors.

    Raises:
        InputError: joints that form no chain of revolute joints, a tip elsewhere, links without mass.
    """
    tree = RigidBodyTree.from_urdf(text, joints)
    _require_chain(tree, joints, where)
    robot = ElementTree.fromstring(text)
    carried = _carried_links(robot, tree.dof_names)
    if carried.get(tip, ("", None))[0] != tree.dof_names[-1]:
        raise InputError(f"{where}.tip is '{tip}', no link that joint '{tree.dof_names[-1]}' carries; name one")
    turns = [_principal(tree.axis[k], tree.inertia[k]) for k in range(tree.dofs)]
    before = [np.eye(3), *turns]
    places = [
        Placement(before[k].T @ tree.placement_rotation[k] @ turns[k], before[k].T @ tree.placement_translation[k])
        for k in range(tree.dofs)
    ]
    children = {joint.get("name"): child for joint in robot.findall("joint") for child in joint.findall("child")}
    return UrdfFinger(
        joints=tree.dof_names,
        links=tuple(str(children[name].get("link")) for name in tree.dof_names),
        columns=tuple(int(column) for column in tree.follow),
        limits=np.stack([tree.lower, tree.upper], axis=1),
        base=places[0],
        places=tuple(places[1:]),
        mass=tree.mass,
        com=np.stack([turn.T @ com for turn, com in zip(turns, tree.com, strict=True)]),
        inertia=np.stack([np.diag(turn.T @ own @ turn) for turn, own in zip(turns, tree.inertia, strict=True)]),
        shapes=_shapes(robot, carried, tree.dof_names, turns),
        tip=turns[-1].T @ carried[tip][1].translation,
    )


def _require_chain(tree: RigidBodyTree, joints: tuple[str, ...], where: str) -> None:
    actuated = tuple(name for k, name in enumerate(tree.dof_names) if name in joints)
    if list(tree.parent) != list(range(-1, tree.dofs - 1)) or actuated != joints:
        raise InputError(f"{where}.joints are {', '.join(joints)}; list a chain, from the palm to the tip")
    for k, name in enumerate(tree.dof_names):
        if tree.prismatic[k]:
            raise InputError(f"{where}: joint '{name}' slides; fingers have revolute joints")
        if not np.all(np.isfinite([tree.lower[k], tree.upper[k]])):
            raise InputError(f"{where}: joint '{name}' has no limits; give it <limit lower= upper=> [rad]")
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


def _carried_links(robot: ElementTree.Element, moving: tuple[str, ...]) -> dict[str, tuple[str, Placement]]:
    """The moving joint that carries each link ("" for the root's), and where the link's frame is in that joint's."""
    joints = {}
    for element in robot.findall("joint"):
        name = str(element.get("name"))
        ends = [found.get("link") for end in ("parent", "child") if (found := element.find(end)) is not None]
        joints[ends[1]] = name, ends[0], placement_of(element, f"joint '{name}'")

    def find(link: str | None) -> tuple[str, Placement]:
        if link not in joints:
            return "", Placement()
        name, parent, place = joints[link]
        if name in moving:
            return name, Placement()
        carrier, above = find(parent)
        return carrier, above.then(place)

    links = [str(link.get("name")) for link in robot.findall("link")]
    return {link: find(link) for link in links}


def _shapes(
    robot: ElementTree.Element, carried: dict[str, tuple[str, Placement]], joints: tuple[str, ...], turns: list[Array]
) -> tuple[tuple[CollisionShape, ...], ...]:
    """Collision shapes of what each joint carries, in the turned frames."""
    found: list[list[CollisionShape]] = [[] for _ in joints]
    for link in robot.findall("link"):
        joint, place = carried[str(link.get("name"))]
        if joint in joints:
            k = joints.index(joint)
            found[k] += [moved(shape, turns[k]) for shape in read_shapes(link, place)]
    return tuple(map(tuple, found))


def palm_shapes(text: str, moving: tuple[str, ...]) -> list[CollisionShape]:
    """Collision shapes of what no joint moves, in the root link's frame: for pictures only."""
    robot = ElementTree.fromstring(text)
    carried = _carried_links(robot, moving)
    placed = [(link, *carried[str(link.get("name"))]) for link in robot.findall("link")]
    return [shape for link, joint, place in placed if not joint for shape in read_shapes(link, place)]
