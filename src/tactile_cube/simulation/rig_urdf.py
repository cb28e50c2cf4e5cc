"""URDF text from the numbers of the control step, so that Bullet moves exactly the mechanism that was fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_cube.hand.urdf import roll_pitch_yaw

Array = NDArray[np.float64]


def tree_urdf(numbers: dict[str, Array], parent: Sequence[int], prismatic: Sequence[int], axes: Array) -> str:
    """A robot with links `link0` .. and free joints `joint0` .., without shapes.

    Args:
        numbers: `placement_rotation` (N, 3, 3), `placement_translation`, `axis`, `com` (N, 3), `mass` (N,).
        parent: Index of each link's parent, -1 for the base.
        prismatic: 1 where a joint slides.
        axes: Principal axes of each link's inertia, in the link's frame (N, 3, 3); their moments are set afterwards.
    """
    base = '<link name="base"><inertial><mass value="1"/>' + _INERTIA + "</inertial></link>"
    parts = ['<?xml version="1.0"?>', '<robot name="rig">', base]
    for k, above in enumerate(parent):
        centre = _origin(numbers["com"][k], axes[k])
        mass = f'<mass value="{numbers["mass"][k]:.17g}"/>'
        parts.append(f'<link name="link{k}"><inertial>{centre}{mass}{_INERTIA}</inertial></link>')
        kind = "prismatic" if prismatic[k] else "continuous"
        limit = '<limit lower="1" upper="-1" effort="1e9" velocity="1e9"/>'  # Bullet: no limits
        place = _origin(numbers["placement_translation"][k], numbers["placement_rotation"][k])
        ends = f'<parent link="{"base" if above < 0 else f"link{above}"}"/><child link="link{k}"/>'
        axis = f'<axis xyz="{_text(numbers["axis"][k])}"/>'
        parts.append(f'<joint name="joint{k}" type="{kind}">{ends}{place}{axis}{limit}</joint>')
    return "\n".join([*parts, "</robot>"])


_INERTIA = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'


def _origin(position: Array, rotation: Array) -> str:
    return f'<origin xyz="{_text(position)}" rpy="{_text(roll_pitch_yaw(rotation))}"/>'


def _text(values: Array) -> str:
    return " ".join(f"{value:.17g}" for value in values)
