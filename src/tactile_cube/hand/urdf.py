"""One description of the hand for PyBullet, the rigid-body equations and Rerun: URDF text from a HandModel.

A finger's root link is the frame of q1. Every link's x axis points along the link, joints turn about z.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.hand.model import Array, Capsule, HandModel, Link

_ACROSS = '<origin xyz="0 0 0" rpy="1.5707963267948966 0 0"/>'
_COLOURS = {"palm": "0.35 0.37 0.40 1", "link": "0.72 0.74 0.78 1", "tip": "0.13 0.15 0.18 1"}


def finger_urdf(hand: HandModel, prefix: str = "") -> str:
    """One finger as a robot of its own, rooted in the frame of q1: joints q1, q2, q3 and q4 which mimics q3.

    Args:
        hand: The hand; all its fingers are identical, so no finger is named.
        prefix: Put before link and joint names, e.g. `ring_`.
    """
    root = f"{prefix}base"
    return _robot(f"{prefix}finger", [_root(root), *_finger_parts(hand, prefix, root, "")])


def hand_urdf(hand: HandModel) -> str:
    """The whole hand: `palm` and four fingers, joints `ring_q1` .. `thumb_q4`; the same links as `finger_urdf`."""
    parts = [_palm(hand)]
    for finger in hand.fingers:
        parts += _finger_parts(hand, f"{finger.name}_", "palm", _origin(finger.position, finger.rotation))
    return _robot("dlr_hand2", parts)


def _robot(name: str, parts: list[str]) -> str:
    return "\n".join(['<?xml version="1.0"?>', f'<robot name="{name}">', *parts, "</robot>", ""])


def _root(name: str) -> str:
    """The fixed base; its numbers do nothing, but Bullet warns about links without any."""
    inertia = '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><mass value="0.1"/>{inertia}</inertial></link>'


def _finger_parts(hand: HandModel, prefix: str, parent: str, base: str) -> list[str]:
    """Links and joints of a finger whose q1 frame sits at `base` (an origin element) in `parent`."""
    knuckle, proximal, middle, distal = hand.links
    lower, upper = hand.lower[:3], hand.upper[:3]
    mimic = f'<mimic joint="{prefix}q3" multiplier="1" offset="0"/>'
    name = [prefix + link.name for link in hand.links]
    along = [_origin(np.array([link.length, 0.0, 0.0])) for link in (proximal, middle)]
    return [
        *(_link(prefix, link) for link in (knuckle, proximal, middle, distal)),
        _joint(f"{prefix}q1", parent, name[0], base, lower[0], upper[0]),
        _joint(
            f"{prefix}q2", name[0], name[1], '<origin xyz="0 0 0" rpy="1.5707963267948966 0 0"/>', lower[1], upper[1]
        ),
        _joint(f"{prefix}q3", name[1], name[2], along[0], lower[2], upper[2]),
        _joint(f"{prefix}q4", name[2], name[3], along[1], lower[2], hand.coupled_upper, mimic),
    ]


def _joint(name: str, parent: str, child: str, origin: str, lower: float, upper: float, extra: str = "") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    limit = f'<limit lower="{lower:.10g}" upper="{upper:.10g}" effort="10" velocity="50"/>'
    return f'<joint name="{name}" type="revolute">{ends}{origin}<axis xyz="0 0 1"/>{limit}{extra}</joint>'


def _link(prefix: str, link: Link) -> str:
    ixx, iyy, izz = link.inertia()
    inertia = f'<inertia ixx="{ixx:.10g}" iyy="{iyy:.10g}" izz="{izz:.10g}" ixy="0" ixz="0" iyz="0"/>'
    inertial = f'<inertial><origin xyz="{link.centre_of_mass} 0 0"/><mass value="{link.mass}"/>{inertia}</inertial>'
    colour = _COLOURS["tip" if link.name == "distal" else "link"]
    shapes = (
        "" if link.capsule is None else _collision(link.capsule) + _visual(prefix + link.name, link.capsule, colour)
    )
    return f'<link name="{prefix}{link.name}">{inertial}{shapes}</link>'


def _collision(capsule: Capsule) -> str:
    length = capsule.end - capsule.start
    geometry = f'<geometry><capsule radius="{capsule.radius}" length="{length:.10g}"/></geometry>'
    return f"<collision>{_along_x(0.5 * (capsule.start + capsule.end))}{geometry}</collision>"


def _visual(name: str, capsule: Capsule, colour: str) -> str:
    """The same capsule as a cylinder and two spheres, which every URDF reader can draw."""
    material = f'<material name="{name}"><color rgba="{colour}"/></material>'
    cylinder = f'<geometry><cylinder radius="{capsule.radius}" length="{capsule.end - capsule.start:.10g}"/></geometry>'
    middle = 0.5 * (capsule.start + capsule.end)
    body = f"<visual>{_along_x(middle)}{cylinder}{material}</visual>"
    sphere = f'<geometry><sphere radius="{capsule.radius}"/></geometry>{material}'
    ends = "".join(f'<visual><origin xyz="{x} 0 0"/>{sphere}</visual>' for x in (capsule.start, capsule.end))
    return body + ends


def _palm(hand: HandModel) -> str:
    """The palm as a slab under the finger bases, for pictures only: nothing ever reaches it."""
    bases = np.array([finger.position for finger in hand.fingers])
    low, high = bases.min(axis=0), bases.max(axis=0)
    size = np.array([high[0] - low[0], high[1] - low[1] + 0.03, 0.10])
    centre = np.array([*(0.5 * (low + high))[:2], low[2] - 0.05])
    geometry = f'<geometry><box size="{_numbers(size)}"/></geometry>'
    material = f'<material name="palm"><color rgba="{_COLOURS["palm"]}"/></material>'
    return f'<link name="palm"><visual>{_origin(centre)}{geometry}{material}</visual></link>'


def _along_x(middle: float) -> str:
    return f'<origin xyz="{middle:.10g} 0 0" rpy="0 1.5707963267948966 0"/>'


def _origin(position: Array, rotation: Array | None = None) -> str:
    rpy = np.zeros(3) if rotation is None else Rotation.from_matrix(rotation).as_euler("xyz")
    return f'<origin xyz="{_numbers(position)}" rpy="{_numbers(rpy)}"/>'


def _numbers(values: Array) -> str:
    return " ".join(f"{value:.12g}" for value in values)
