"""URDF text to a list of movable joints, parents first, each with the rigid body that it carries.

Fixed and locked joints disappear: what hangs on them is merged into the link before them.
"""

import re
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.hand.urdf_elements import (
    Body,
    Joint,
    Mimic,
    Placement,
    attribute,
    balanced,
    body_of,
    joint_of,
    principal_moments,
)
from tactile_cube.untrusted_file import below, regular

XACRO = "URDF: it is a xacro file, which other programs turn into a URDF; run xacro first: xacro FILE > robot.urdf"
UNEXPANDED = re.compile(r"\$[{(]")  # what xacro would replace in an attribute
Homes = dict[str, tuple[str, Placement]]
"""The link that each link moves with, itself or the root's included, and where its frame is in that link's."""


def read_movable_joints(
    text: str, joints: Sequence[str] | None = None, coupled: Mapping[str, Mimic] | None = None
) -> tuple[list[Joint], Homes, tuple[str, ...], tuple[str, ...]]:
    """Return the moving joints, parents first; the places of all links; the actuated joints in order; corrections.

    See `RigidBodyTree.from_urdf` for the arguments.
    """
    every, bodies = read_joints(text)
    movable = [j.name for j in every if j.movable]
    for name in (*(coupled or ()), *(joints or ())):
        if name not in movable:
            raise InputError(f"URDF: it has no movable joint '{name}'; movable: {', '.join(movable) or 'none'}")
    if coupled:
        every = [replace(j, coupling=coupled[j.name]) if j.name in coupled else j for j in every]
    leaders = [j.name for j in every if j.movable and j.coupling is None]
    actuated = tuple(leaders if joints is None else joints)
    if not actuated:
        raise InputError("URDF: no joint of it can move; a mechanism needs at least one")
    if len(set(actuated)) < len(actuated):
        raise InputError(f"joints: {', '.join(actuated)} names a joint twice; name each once")
    for k, joint in enumerate(every):
        leader = joint.coupling.joint if joint.coupling else joint.name
        if joint.coupling and joint.name in actuated:
            raise InputError(f"joint '{joint.name}' is actuated and follows '{leader}'; choose one")
        if joint.coupling and leader not in leaders:
            known = ", ".join(sorted(leaders)) or "none"
            raise InputError(
                f"joint '{joint.name}' follows '{leader}', which does not move on its own; name one of {known}"
            )
        if joint.movable and leader not in actuated:  # locked; a follower of a locked joint too
            every[k] = replace(joint, kind="fixed")
    moving, homes, impossible = _merge_fixed(*_parents_first(every, bodies))
    return moving, homes, actuated, _corrections(every, impossible)


def read_joints(text: str) -> tuple[list[Joint], dict[str, Body]]:
    """Read all joints of a URDF, fixed ones too, and the bodies by link.

    Raises:
        InputError: it is no URDF, uses a name twice, or has a number that no mechanism has.
    """
    robot = robot_of(text)
    links, joints = robot.findall("link"), robot.findall("joint")
    if len(joints) > limits.JOINTS:
        raise InputError(f"URDF: it has {len(joints)} joints; at most {limits.JOINTS} are read")
    for kind, elements in (("link", links), ("joint", joints)):
        names = [attribute(element, "name", f"a {kind}") for element in elements]
        twice = [name for name, count in Counter(names).items() if count > 1]
        if twice:
            raise InputError(f"URDF: two {kind}s are called '{twice[0]}'; rename one")
    bodies = {str(link.get("name")): body_of(link) for link in links}
    return [joint_of(element, bodies) for element in joints], bodies


def robot_of(text: str) -> ElementTree.Element:
    """Return the root element of a URDF. Raises InputError: it is no URDF."""
    try:
        robot = ElementTree.fromstring(text.lstrip("\ufeff \r\n\t"))
    except (ElementTree.ParseError, ValueError, LookupError) as error:  # an encoding that is none
        if "<xacro:" in text:
            raise InputError(XACRO) from None
        raise InputError(f"URDF: not well-formed XML: {error}") from None
    if robot.tag != "robot":
        raise InputError(f"URDF: the root element is <{robot.tag}>; it must be <robot>")
    if any(
        "/xacro}" in part.tag or any(UNEXPANDED.search(value) for value in part.attrib.values())
        for part in robot.iter()
    ):
        raise InputError(XACRO)
    return robot


def _parents_first(every: list[Joint], bodies: Mapping[str, Body]) -> tuple[str, list[Joint]]:
    """Return the root link, and the joints in depth-first order, which is PyBullet's order too."""
    children = [j.link for j in every]
    for name in children:
        if children.count(name) > 1:
            raise InputError(f"URDF: link '{name}' has more than one parent joint; only trees can be simulated")
    reached = [name for name in bodies if name not in children]
    if len(reached) != 1:
        found = ", ".join(reached) or "none (a loop)"
        raise InputError(f"URDF: a tree has exactly one root link; found {found}")
    ordered: list[Joint] = []
    waiting = [j for j in every if j.parent == reached[0]]
    while waiting:
        joint, *others = waiting
        ordered.append(joint)
        waiting = [j for j in every if j.parent == joint.link] + others
    if len(ordered) < len(every):
        lost = next(j.name for j in every if j not in ordered)
        raise InputError(f"URDF: joint '{lost}' does not hang on the root link '{reached[0]}'; connect it")
    return reached[0], ordered


def _merge_fixed(root: str, ordered: list[Joint]) -> tuple[list[Joint], Homes, list[Joint]]:
    """Move what hangs on a fixed joint into the link before it; also the moving links that no body could be."""
    homes: Homes = {root: (root, Placement())}
    moving: dict[str, Joint] = {}
    impossible = []
    for joint in ordered:
        carrier, place = homes[joint.parent]
        placed = place.then(joint.placement)
        homes[joint.link] = (joint.link, Placement()) if joint.movable else (carrier, placed)
        if not (joint.movable or carrier in moving):
            continue
        body = balanced(joint.body, joint.link)
        impossible += [] if body is joint.body else [joint]
        if joint.movable:
            moving[joint.link] = replace(joint, parent=carrier, placement=placed, body=body)
        else:
            merged = moving[carrier].body.joined(body.seen_from(placed))
            moving[carrier] = replace(moving[carrier], body=merged)
    return list(moving.values()), homes, impossible


def _corrections(every: list[Joint], impossible: list[Joint]) -> tuple[str, ...]:
    said = [f"joint '{joint.name}' is {joint.kind}; its link '{joint.link}' is held" for joint in every if joint.free]
    if impossible:
        first = principal_moments(impossible[0].body)
        names = ", ".join(f"'{joint.link}'" for joint in impossible)
        said.append(
            f"no body has the moments of inertia of {names}; each link gets the mean of its three, as by MuJoCo's "
            f"balanceinertia: '{impossible[0].link}' {first.mean():.4g} kg m^2 in place of "
            + ", ".join(f"{moment:.4g}" for moment in first)
        )
    return tuple(said)


SHAPES = ("visual", "collision")
MESHES = (".obj", ".stl")
PARTS = re.compile(r"^\s*(?:mtllib|map_\w+|bump|disp|decal|refl|norm)\s(.+)$", re.MULTILINE | re.IGNORECASE)
"""Lines of an OBJ file that name materials, and of a material that name pictures."""


def with_own_files(urdf: str, file: Path, root: Path, shapes: tuple[str, ...] = SHAPES) -> tuple[str, list[str]]:
    """Return a URDF, read from `file`, whose files lie below `root` and have absolute names, with `shapes` alone.

    `package://NAME/` stands for the root. Shapes whose files lie elsewhere or are not there are left out; why is said.

    Raises:
        InputError: no URDF, or elements nested too deeply.
    """
    robot, left_out = robot_of(urdf), []
    waiting = [robot]
    while waiting:
        parent = waiting.pop()
        for child in list(parent):
            tag = _local(child.tag)
            if tag in SHAPES and tag not in shapes:
                parent.remove(child)
                continue
            try:
                _make_absolute(child, file.parent, root, f"{file}: link '{parent.get('name')}'")
            except InputError as error:
                parent.remove(child)
                left_out.append(str(error))
            else:
                waiting += [] if tag in SHAPES else [child]
    try:
        return ElementTree.tostring(robot, encoding="unicode"), left_out
    except RecursionError:
        raise InputError(f"{file}: its elements are nested too deeply") from None


def package_of(urdf: Path) -> Path:
    """Return the folder whose files a URDF may name: that of its ROS package, else its own."""
    folder = urdf.resolve().parent
    return next((one for one in (folder, *folder.parents[:2]) if (one / "package.xml").is_file()), folder)


def require_mesh(file: Path, where: str) -> None:
    """Refuse a mesh that no engine reads, and one with materials or pictures from elsewhere: films would show them.

    Raises:
        InputError: naming it.
    """
    if file.suffix.lower() not in MESHES:
        raise InputError(f"URDF: {where} has the mesh {file}; convert it to {' or '.join(MESHES)}")
    if file.suffix.lower() == ".obj":
        for material in _require_parts(file):
            if material.exists():
                _require_parts(regular(material, limits.TEXT))


def _require_parts(file: Path) -> list[Path]:
    lines = PARTS.findall(file.read_text(encoding="utf-8", errors="replace"))
    return [below(file.parent, word, str(file)) for line in lines for word in line.split()]


def _make_absolute(element: ElementTree.Element, folder: Path, root: Path, where: str) -> None:
    """Make file names absolute: of a shape all that it contains, of another element only its own."""
    for part in element.iter() if _local(element.tag) in SHAPES else (element,):
        if _local(part.tag) == "filename":  # as some readers have it
            raise InputError(f"{where}: <filename> is an attribute; write filename=")
        for key, name in part.items():
            if _local(key) == "filename":
                inside = name.startswith("package://")
                name = name.removeprefix("package://").partition("/")[2] if inside else name
                file = below(root if inside else folder, name, f"{where}, <{_local(part.tag)}>", root)
                part.set(key, str(regular(file, limits.MESH).resolve()))


def _local(name: str) -> str:
    return name.rpartition("}")[2]
