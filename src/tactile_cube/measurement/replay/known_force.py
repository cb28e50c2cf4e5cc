"""Joint torques of a known force on a link: J(q)^T f."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.measurement.recordings.description import KnownForce

Array = NDArray[np.float64]


def force_torque(tree: RigidBodyTree, force: KnownForce, position: Array) -> Array:
    """Torques (joints,) [N m] that a force on a link puts on the actuated joints at `position` (joints,) [rad].

    Raises:
        InputError: the force names a joint that the rig does not have.
    """
    if force.joint not in tree.dof_names:
        raise InputError(f"trials: key 'force.joint': '{force.joint}' is not a joint of the rig {list(tree.dof_names)}")
    dof, frames = tree.dof_names.index(force.joint), link_frames(tree, position)
    rotation, origin = frames[dof]
    point, vector = origin + rotation @ np.asarray(force.point), np.asarray(force.vector)
    torque = np.zeros(len(tree.joint_names))
    while dof >= 0:
        rotation, origin = frames[dof]
        axis = rotation @ tree.axis[dof]
        lever = axis if tree.prismatic[dof] else np.cross(axis, point - origin)
        torque[tree.follow[dof]] += tree.ratio[dof] * float(lever @ vector)
        dof = int(tree.parent[dof])
    return torque


def link_frames(tree: RigidBodyTree, position: Array) -> list[tuple[Array, Array]]:
    """Rotation (3, 3) and origin (3,) [m] of every link in the base frame, at actuated `position` (joints,)."""
    angles = tree.ratio * position[tree.follow] + tree.offset
    frames: list[tuple[Array, Array]] = []
    for dof in range(tree.dofs):
        parent = int(tree.parent[dof])
        rotation, origin = frames[parent] if parent >= 0 else (np.eye(3), np.zeros(3))
        placed = rotation @ tree.placement_rotation[dof]
        origin = origin + rotation @ tree.placement_translation[dof]
        if tree.prismatic[dof]:
            frames.append((placed, origin + placed @ tree.axis[dof] * angles[dof]))
        else:
            frames.append((placed @ Rotation.from_rotvec(tree.axis[dof] * angles[dof]).as_matrix(), origin))
    return frames
