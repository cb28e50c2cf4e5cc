"""Fingertips from joint angles and back, in closed form.

A finger is planar behind q1: with e = exp(i q3) the tip's centre lies at exp(i q2) (a + b e + c e^2) in the plane that
q1 turns about the base's z axis, where a, b, c are the distances q2-q3, q3-q4 and q4-tip.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.hand.model import JOINTS_PER_FINGER, Array, HandModel

_ROOM = 2e-3
"""A point of a face counts as reachable only with this gap [m], so that a grasp and its approach take the same one."""
_REACHED = 1e-5
"""A fingertip this near to its target has reached it [m]."""


def tip_positions(hand: HandModel, angles: Array) -> Array:
    """Centres of the fingertip spheres in the world (fingers, 3) [m], for joint angles (12,) [rad]."""
    q = np.asarray(angles, dtype=np.float64).reshape(-1, 1, JOINTS_PER_FINGER)
    return np.concatenate([_finger_tips(hand, k, q[k]) for k in range(len(hand.fingers))])


def _finger_tips(hand: HandModel, finger: int, q: Array) -> Array:
    """One finger's tip centres in the world (n, 3) [m] for its joint angles (n, 3) [rad]."""
    a, b, c = hand.tip_reach
    planar = np.exp(1j * q[:, 1]) * (a + b * np.exp(1j * q[:, 2]) + c * np.exp(2j * q[:, 2]))
    local = np.stack([planar.real * np.cos(q[:, 0]), planar.real * np.sin(q[:, 0]), planar.imag], axis=1)
    origin, rotation = hand.base_in_world(finger)
    return origin + local @ rotation.T


def finger_angles(hand: HandModel, finger: int, targets: Array) -> Array:
    """Joint angles (n, 3) [rad] that bring one fingertip's centre to world points (n, 3) [m].

    Of the two solutions the flexed one (q3 >= 0) is given. A point out of reach gives the straight or the fully folded
    finger that points at it. Joint limits are not applied.
    """
    origin, rotation = hand.base_in_world(finger)
    local = (np.asarray(targets, dtype=np.float64).reshape(-1, 3) - origin) @ rotation
    q1 = np.arctan2(local[:, 1], local[:, 0])
    planar = np.hypot(local[:, 0], local[:, 1]) + 1j * local[:, 2]
    q3 = _flexion(hand.tip_reach, np.abs(planar) ** 2)
    a, b, c = hand.tip_reach
    q2 = np.angle(planar) - np.angle(a + b * np.exp(1j * q3) + c * np.exp(2j * q3))
    return np.stack([q1, q2, q3], axis=1)


def _flexion(reach: tuple[float, float, float], squared_distance: Array) -> Array:
    """q3 >= 0 [rad] from |a + b e + c e^2|^2, a quadratic equation in cos q3."""
    a, b, c = reach
    linear = 2.0 * b * (a + c)
    constant = a * a + b * b + c * c - 2.0 * a * c - squared_distance
    root = np.sqrt(np.maximum(linear**2 - 16.0 * a * c * constant, 0.0))
    return np.arccos(np.clip((root - linear) / (8.0 * a * c), -1.0, 1.0))


def grasp_angles(
    hand: HandModel,
    cube_size: Array | Sequence[float],
    position: Array | Sequence[float],
    quaternion: Array | Sequence[float],
    clearance: float = 1e-3,
) -> Array:
    """Joint angles with each finger at its face of the cube, tips `clearance` [m] off it (negative: pressing).

    Each finger aims at the middle of its face. Where the action limits forbid that it takes the nearest point of the
    face that they and the finger's length allow, and where there is none the angles that come nearest.

    Args:
        hand: The hand.
        cube_size: Edge lengths (3,) [m].
        position: Cube centre in the world (3,) [m].
        quaternion: Cube orientation (4,), xyzw.
        clearance: Gap between tip and face [m].

    Returns:
        Joint angles (12,) [rad], within the action limits.
    """
    half = 0.5 * np.asarray(cube_size, dtype=np.float64)
    rotation = Rotation.from_quat(np.asarray(quaternion)).as_matrix()
    centre = np.asarray(position, dtype=np.float64)
    angles = []
    for k, finger in enumerate(hand.fingers):
        offsets = _offsets_on_face(finger.face, half)
        off, on = (finger.face * (half + hand.tip_radius + gap) for gap in (max(clearance, _ROOM), clearance))
        chosen = offsets[_first_reachable(hand, k, centre + (off + offsets) @ rotation.T)]
        angles.append(_within_limits(hand, k, centre + (on + chosen)[None] @ rotation.T)[0])
    return np.concatenate(angles)


def _offsets_on_face(face: Array, half: Array) -> Array:
    """Grid of points on a face relative to its middle (n, 3) [m], nearest first, up to 70 % of the way to the edges."""
    sideways = np.cross([0.0, 0.0, 1.0], face)
    across = np.linspace(-0.7, 0.7, 15) * float(np.abs(sideways) @ half)
    up = np.linspace(-0.7, 0.7, 9) * half[2]
    grid = np.array([s * sideways + np.array([0.0, 0.0, z]) for s in across for z in up])
    return grid[np.argsort(np.linalg.norm(grid, axis=1), kind="stable")]


def _first_reachable(hand: HandModel, finger: int, targets: Array) -> int:
    """Index of the first target that limits and finger length allow, else of the nearest miss."""
    tips = _finger_tips(hand, finger, _within_limits(hand, finger, targets))
    miss = np.linalg.norm(tips - targets, axis=1)
    return int(np.argmax(miss < _REACHED) if np.any(miss < _REACHED) else np.argmin(miss))


def _within_limits(hand: HandModel, finger: int, targets: Array) -> Array:
    """Angles (n, 3) [rad] towards targets (n, 3) [m], clipped to the action limits."""
    joints = slice(JOINTS_PER_FINGER * finger, JOINTS_PER_FINGER * (finger + 1))
    return np.clip(finger_angles(hand, finger, targets), hand.action_lower[joints], hand.action_upper[joints])
