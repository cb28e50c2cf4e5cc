"""Forward kinematics of the fingertips, and joint angles of grasps around an object."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.hand.chain import PlanarChain
from tactile_cube.hand.hand import Hand
from tactile_cube.hand.object_mesh import ObjectShape, tip_centres
from tactile_cube.hand.urdf import Array

_ROOM = 2e-3
"""A point of a face counts as reachable only with this gap [m], so that a grasp and its approach take the same one."""
_REACHED = 1e-5  # A fingertip this near to its target has reached it [m]


def tip_positions(hand: Hand, angles: Array) -> Array:
    """Return the centres of the fingertip spheres in the world (fingers, 3) [m], for joint angles (joints,) [rad]."""
    q = np.asarray(angles, dtype=np.float64).reshape(-1, hand.joints_per_finger)
    chain = hand.fingers[0].chain
    if isinstance(chain, PlanarChain) and all(finger.chain == chain for finger in hand.fingers):
        return chain.tips(*hand.bases, q)  # all at once
    return np.concatenate([hand.finger_tips(k, q[k : k + 1]) for k in range(len(hand.fingers))])


def grasp_angles(
    hand: Hand,
    cube_size: Array | Sequence[float],
    position: Array | Sequence[float],
    quaternion: Array | Sequence[float],
    clearance: float = 1e-3,
    shape: ObjectShape = "box",
) -> Array:
    """Return joint angles with each finger at its side of the object, tips `clearance` [m] off it (negative: pressing).

    Each finger aims at the middle of its face. Where the action limits forbid that it takes the nearest point of the
    face that they and the finger's length allow, and where there is none the angles that come nearest.

    The object has a bounding box of edges `cube_size` (3,) [m], its centre at `position` (3,) [m] in the world, turned
    by `quaternion` (4,), xyzw. Angles (joints,) [rad] are within the action limits.
    """
    half = 0.5 * np.asarray(cube_size, dtype=np.float64)
    rotation = Rotation.from_quat(np.asarray(quaternion)).as_matrix()
    centre = np.asarray(position, dtype=np.float64)
    angles = []
    for k, finger in enumerate(hand.fingers):
        gaps = (max(clearance, _ROOM), clearance)
        off, on = (tip_centres(shape, finger.face, half, hand.tip_radius, gap) for gap in gaps)
        aims = centre + off @ rotation.T
        miss = _misses(hand, k, aims[:1])
        if not miss[0] < _REACHED:  # seldom: else the others need not be looked at
            miss = _misses(hand, k, aims)
        chosen = int(np.argmax(miss < _REACHED) if np.any(miss < _REACHED) else np.argmin(miss))
        angles.append(_within_limits(hand, k, centre + on[chosen][None] @ rotation.T)[0])
    return np.concatenate(angles)


def _misses(hand: Hand, finger: int, targets: Array) -> Array:
    """Return the distance of a fingertip from targets (n, 3) within the joint limits (n,) [m]."""
    tips = hand.finger_tips(finger, _within_limits(hand, finger, targets))
    return np.asarray(np.linalg.norm(tips - targets, axis=1))


def _within_limits(hand: Hand, finger: int, targets: Array) -> Array:
    """Return the angles (n, joints_per_finger) [rad] towards targets (n, 3) [m], clipped to the action limits."""
    joints = hand.of_finger(finger)
    return np.clip(hand.finger_angles(finger, targets), hand.action_lower[joints], hand.action_upper[joints])
