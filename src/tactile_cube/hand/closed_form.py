"""Fingertips from joint angles and back, in closed form, for fingers like those of the DLR-Hand II.

A finger is planar behind q1: with e = exp(i q3) the tip's centre lies at exp(i q2) (a + b e + c e^2) in the plane that
q1 turns about the base's z axis, where a, b, c are the distances q2-q3, q3-q4 and q4-tip.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tactile_cube.hand.model import HandModel

Array = NDArray[np.float64]


def finger_tips(hand: HandModel, finger: int, q: Array) -> Array:
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
