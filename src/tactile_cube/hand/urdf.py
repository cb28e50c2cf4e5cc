"""One description of the hand for PyBullet, the rigid-body equations and Rerun: URDF text from a HandModel.

A finger's root link is the frame of q1, which turns about its z axis. Every further link's z axis points along the link
and its joint turns about y.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError

if TYPE_CHECKING:
    from tactile_cube.hand.model import Capsule, HandModel, Link

Array = NDArray[np.float64]

_AXIS_Y, _AXIS_Z = '<axis xyz="0 1 0"/>', '<axis xyz="0 0 1"/>'
_ACROSS = f'<origin xyz="0 0 0" rpy="{np.pi} {-np.pi / 2.0} 0"/>'
"""From q1's frame to q2's: z along the finger, which is x of the base, y against y of the base."""
_UPRIGHT = 1e-9
_COLOURS = {"palm": "0.35 0.37 0.40 1", "link": "0.72 0.74 0.78 1", "tip": "0.13 0.15 0.18 1"}


def finger_urdf(hand: HandModel, prefix: str = "") -> str:
    """One finger as a robot of its own, rooted in the frame of q1: joints q1, q2, q3 and q4 which mimics q3.

    Args:
        hand: The hand; all its fingers are identical, so no finger is named.
        prefix: Put before link and joint names, e.g. `ring_`.
    """
    root = f"{prefix}base"
    return robot_element(f"{prefix}finger", [ROBOT_ROOT.format(name=root), *_finger_parts(hand, prefix, root, "")])


def with_inertias(urdf: str, links: Sequence[str], mass: Array, com: Array, inertia: Array) -> str:
    """The same robot with other masses of its links.

    Args:
        urdf: Its description.
        links: Names of the links to change.
        mass: (n,) [kg].
        com: Centres of mass in the link's frame (n, 3) [m].
        inertia: About the centre of mass in the link's axes (n, 3, 3) [kg m^2].
    """
    robot = ElementTree.fromstring(urdf)
    for k, name in enumerate(links):
        inertial = robot.find(f"link[@name='{name}']/inertial")
        if inertial is None:
            raise InputError(f"URDF: no link '{name}' with an inertial element")
        upper = zip(["xx", "xy", "xz", "yy", "yz", "zz"], inertia[k][np.triu_indices(3)], strict=True)
        numbers = {
            "origin": {"xyz": number_list(com[k])},
            "mass": {"value": f"{mass[k]:.12g}"},
            "inertia": {f"i{axes}": f"{value:.12g}" for axes, value in upper},
        }
        for child in list(inertial):
            inertial.remove(child)
        for tag, attributes in numbers.items():
            ElementTree.SubElement(inertial, tag, attributes)
    return ElementTree.tostring(robot, encoding="unicode")


def hand_urdf(hand: HandModel) -> str:
    """The whole hand: `palm` and four fingers, joints `ring_q1` .. `thumb_q4`; the same links as `finger_urdf`."""
    parts = [_palm(hand)]
    for finger in hand.fingers:
        parts += _finger_parts(hand, f"{finger.name}_", "palm", origin_element(finger.position, finger.rotation))
    return robot_element("dlr_hand2", parts)


ROBOT_ROOT = (
    '<link name="{name}"><inertial><mass value="0.1"/>'
    '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
"""The fixed base; its numbers do nothing, but Bullet warns about links without any."""


def robot_element(name: str, parts: list[str]) -> str:
    """A whole description from its links and joints."""
    return "\n".join(['<?xml version="1.0"?>', f'<robot name="{name}">', *parts, "</robot>", ""])


def _finger_parts(hand: HandModel, prefix: str, parent: str, base: str) -> list[str]:
    """Links and joints of a finger whose q1 frame sits at `base` (an origin element) in `parent`."""
    knuckle, proximal, middle, distal = hand.links
    lower, upper = hand.lower[:3], hand.upper[:3]
    mimic = f'<mimic joint="{prefix}q3" multiplier="1" offset="0"/>'
    name = [prefix + link.name for link in hand.links]
    along = [origin_element(np.array([0.0, 0.0, link.length])) for link in (proximal, middle)]
    return [
        *(_link(prefix, link) for link in (knuckle, proximal, middle, distal)),
        _joint(f"{prefix}q1", parent, name[0], base, _AXIS_Z, lower[0], upper[0]),
        _joint(f"{prefix}q2", name[0], name[1], _ACROSS, _AXIS_Y, lower[1], upper[1]),
        _joint(f"{prefix}q3", name[1], name[2], along[0], _AXIS_Y, lower[2], upper[2]),
        _joint(f"{prefix}q4", name[2], name[3], along[1], _AXIS_Y, lower[2], hand.coupled_upper, mimic),
    ]


def _joint(
    name: str, parent: str, child: str, origin: str, axis: str, lower: float, upper: float, extra: str = ""
) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    limit = f'<limit lower="{lower:.10g}" upper="{upper:.10g}" effort="10" velocity="50"/>'
    return f'<joint name="{name}" type="revolute">{ends}{origin}{axis}{limit}{extra}</joint>'


def _link(prefix: str, link: Link) -> str:
    ixx, iyy, izz = link.inertia()
    inertia = f'<inertia ixx="{ixx:.10g}" iyy="{iyy:.10g}" izz="{izz:.10g}" ixy="0" ixz="0" iyz="0"/>'
    inertial = f'<inertial><origin xyz="0 0 {link.centre_of_mass}"/><mass value="{link.mass}"/>{inertia}</inertial>'
    colour = _COLOURS["tip" if link.name == "distal" else "link"]
    name = prefix + link.name
    shapes = "" if link.capsule is None else _collision(link.capsule) + _visual(name, link.capsule, colour)
    return f'<link name="{name}">{inertial}{shapes}</link>'


def _collision(capsule: Capsule) -> str:
    length = capsule.end - capsule.start
    geometry = f'<geometry><capsule radius="{capsule.radius}" length="{length:.10g}"/></geometry>'
    return f"<collision>{_at(0.5 * (capsule.start + capsule.end))}{geometry}</collision>"


def _visual(name: str, capsule: Capsule, colour: str) -> str:
    """The same capsule as a cylinder and two spheres, which every URDF reader can draw."""
    material = f'<material name="{name}"><color rgba="{colour}"/></material>'
    cylinder = f'<geometry><cylinder radius="{capsule.radius}" length="{capsule.end - capsule.start:.10g}"/></geometry>'
    middle = 0.5 * (capsule.start + capsule.end)
    body = f"<visual>{_at(middle)}{cylinder}{material}</visual>"
    sphere = f'<geometry><sphere radius="{capsule.radius}"/></geometry>{material}'
    ends = "".join(f"<visual>{_at(end)}{sphere}</visual>" for end in (capsule.start, capsule.end))
    return body + ends


def _palm(hand: HandModel) -> str:
    """The palm as a slab under the finger bases, for pictures only: nothing ever reaches it."""
    bases = np.array([finger.position for finger in hand.fingers])
    low, high = bases.min(axis=0), bases.max(axis=0)
    size = np.array([high[0] - low[0], high[1] - low[1] + 0.03, 0.10])
    centre = np.array([*(0.5 * (low + high))[:2], low[2] - 0.05])
    geometry = f'<geometry><box size="{number_list(size)}"/></geometry>'
    material = f'<material name="palm"><color rgba="{_COLOURS["palm"]}"/></material>'
    return f'<link name="palm"><visual>{origin_element(centre)}{geometry}{material}</visual></link>'


def _at(along: float) -> str:
    return f'<origin xyz="0 0 {along:.10g}"/>'


def origin_element(position: Array, rotation: Array | None = None) -> str:
    """Place (3,) [m] and rotation (3, 3) as URDF's <origin>."""
    rpy = np.zeros(3) if rotation is None else roll_pitch_yaw(rotation)
    return f'<origin xyz="{number_list(position)}" rpy="{number_list(rpy)}"/>'


def roll_pitch_yaw(rotation: Array) -> Array:
    """URDF's angles (3,) [rad] of a rotation matrix (3, 3): about fixed x, then y, then z."""
    level = np.hypot(rotation[0, 0], rotation[1, 0])
    pitch = np.arctan2(-rotation[2, 0], level)
    if level < _UPRIGHT:  # roll and yaw turn about the same axis: leave it all to roll
        return np.array([np.arctan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0])
    roll = np.arctan2(rotation[2, 1], rotation[2, 2])
    return np.array([roll, pitch, np.arctan2(rotation[1, 0], rotation[0, 0])])


def number_list(values: Array) -> str:
    """Numbers with spaces between them."""
    return " ".join(f"{value:.12g}" for value in values)
