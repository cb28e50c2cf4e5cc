"""Writing URDF text: elements that every mechanism has, and other masses for the links of one."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError

Array = NDArray[np.float64]

_UPRIGHT = 1e-9


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


ROBOT_ROOT = (
    '<link name="{name}"><inertial><mass value="0.1"/>'
    '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
"""The fixed base; its numbers do nothing, but Bullet warns about links without any."""


def robot_element(name: str, parts: list[str]) -> str:
    """A whole description from its links and joints."""
    return "\n".join(['<?xml version="1.0"?>', f'<robot name="{name}">', *parts, "</robot>", ""])


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
