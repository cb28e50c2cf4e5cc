"""URDF text to a list of movable joints, parents first, each with the rigid body that it carries.

Fixed and locked joints disappear: what hangs on them is merged into the link before them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import replace

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.hand.urdf_elements import Body, Joint, Mimic, Placement, attribute, body_of, joint_of


def read_movable_joints(
    text: str, joints: Sequence[str] | None = None, coupled: Mapping[str, Mimic] | None = None
) -> tuple[list[Joint], tuple[str, ...]]:
    """The joints that move, parents before children, and the names of the actuated ones in order.

    See `RigidBodyTree.from_urdf` for the arguments.
    """
    every, bodies = read_joints(text)
    if coupled:
        _refuse_unknown(coupled, every)
        every = [replace(j, coupling=coupled[j.name]) if j.name in coupled else j for j in every]
    actuated = _actuated(every, joints)
    _check_couplings(every)
    every = [j if _moves(j, actuated) else replace(j, kind="fixed") for j in every]
    return _merge_fixed(_parents_first(every, bodies)), actuated


def read_joints(text: str) -> tuple[list[Joint], dict[str, Body]]:
    """All joints of a URDF, fixed ones too, and the bodies by link.

    Raises:
        InputError: it is no URDF, names a thing twice, or has a number that no mechanism has.
    """
    robot = robot_of(text)
    links, joints = robot.findall("link"), robot.findall("joint")
    if len(joints) > limits.JOINTS:
        raise InputError(f"URDF: it has {len(joints)} joints; at most {limits.JOINTS} are read")
    for kind, elements in (("link", links), ("joint", joints)):
        names = [attribute(element, "name", f"a {kind}") for element in elements]
        twice = [name for name in set(names) if names.count(name) > 1]
        if twice:
            raise InputError(f"URDF: two {kind}s are called '{twice[0]}'; rename one")
    bodies = {str(link.get("name")): body_of(link) for link in links}
    return [joint_of(element, bodies) for element in joints], bodies


def robot_of(text: str) -> ElementTree.Element:
    """The root element of a URDF.

    Raises:
        InputError: it is no URDF.
    """
    try:
        robot = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, LookupError) as error:  # an encoding that is none
        raise InputError(f"URDF: not well-formed XML: {error}") from None
    if robot.tag != "robot":
        raise InputError(f"URDF: the root element is <{robot.tag}>; it must be <robot>")
    return robot


def _refuse_unknown(names: Mapping[str, Mimic] | Sequence[str], every: list[Joint]) -> None:
    movable = [j.name for j in every if j.kind != "fixed"]
    for name in names:
        if name not in movable:
            raise InputError(f"URDF: it has no movable joint '{name}'; movable: {', '.join(movable) or 'none'}")


def _actuated(every: list[Joint], joints: Sequence[str] | None) -> tuple[str, ...]:
    if joints is None:
        names = tuple(j.name for j in every if j.kind != "fixed" and j.coupling is None)
    else:
        names = tuple(joints)
        _refuse_unknown(names, every)
    if not names:
        raise InputError("URDF: no joint of it can move; a mechanism needs at least one")
    if len(set(names)) < len(names):
        raise InputError(f"joints: {', '.join(names)} names a joint twice; name each once")
    for joint in every:
        if joint.name in names and joint.coupling is not None:
            raise InputError(f"joint '{joint.name}' is actuated and follows '{joint.coupling.joint}'; choose one")
    return names


def _check_couplings(every: list[Joint]) -> None:
    leaders = {j.name for j in every if j.kind != "fixed" and j.coupling is None}
    for joint in every:
        if joint.coupling is not None and joint.coupling.joint not in leaders:
            raise InputError(
                f"joint '{joint.name}' follows '{joint.coupling.joint}', which does not move on its own; name one of "
                f"{', '.join(sorted(leaders)) or 'none'}"
            )


def _moves(joint: Joint, actuated: tuple[str, ...]) -> bool:
    """Whether a joint is actuated or follows one that is; a follower of a locked joint is locked with it."""
    if joint.kind == "fixed":
        return False
    return joint.name in actuated or (joint.coupling is not None and joint.coupling.joint in actuated)


def _parents_first(every: list[Joint], bodies: Mapping[str, Body]) -> list[Joint]:
    """Branch after branch to its end, which is PyBullet's order too."""
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
    return ordered


def _merge_fixed(ordered: list[Joint]) -> list[Joint]:
    """Moves what hangs on a fixed joint into the link before it, and its children with it."""
    home: dict[str, tuple[str, Placement]] = {}
    moving: dict[str, Joint] = {}
    for joint in ordered:
        carrier, place = home.get(joint.parent, (joint.parent, Placement()))
        placed = place.then(joint.placement)
        if joint.kind != "fixed":
            moving[joint.link] = replace(joint, parent=carrier, placement=placed)
            continue
        home[joint.link] = carrier, placed
        if carrier in moving:
            merged = moving[carrier].body.joined(joint.body.seen_from(placed))
            moving[carrier] = replace(moving[carrier], body=merged)
    return list(moving.values())
