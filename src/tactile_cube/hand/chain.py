"""Fingertips from joint angles and back: for any chain of revolute joints, and in closed form for the DLR-Hand II.

A finger of the DLR-Hand II is planar behind q1: with e = exp(i q3) the tip's centre lies at exp(i q2) (a + b e + c e^2)
in the plane that q1 turns about the base's z axis, where `reach` (a, b, c) are the distances q2-q3, q3-q4 and q4-tip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ROUNDS = 40
"""Steps of the search; from the middle of the range, points within reach take five to fifteen."""
_CLOSE = 1e-7
"""A tip this near to its target is there [m]."""
_LONGEST = 0.3
"""Longest step of a joint in one round [rad]."""
_FADING = 0.7
"""How much of the pull towards the middle of the range is left after each round."""


@dataclass(frozen=True)
class Chain:
    """L joints in a row, each turning about z of its frame, of which some move with an actuated one.

    Attributes:
        rotations: frame of each joint in the frame of the link before it, the first one's in the world (L, 3, 3).
        translations: likewise (L, 3) [m].
        columns: the actuated joint that each joint moves with (L,).
        tip: middle of the fingertip in the last link's frame (3,) [m].
    """

    rotations: Array
    translations: Array
    columns: tuple[int, ...]
    tip: Array

    def tips(self, q: Array) -> tuple[Array, Array]:
        """Tip in the world (n, 3) [m] and its velocity per joint velocity (n, 3, J), for angles q (n, J) [rad]."""
        count = len(q)
        place, turn = np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3))
        origins, axes = [], []
        for k, column in enumerate(self.columns):
            place = place + turn @ self.translations[k]
            turn = turn @ self.rotations[k]
            origins.append(place)
            axes.append(turn[:, :, 2])
            turn = turn @ _about_z(q[:, column])
        tip = place + turn @ self.tip
        jacobian = np.zeros((count, 3, q.shape[1]))
        for origin, axis, column in zip(origins, axes, self.columns, strict=True):
            jacobian[:, :, column] += np.cross(axis, tip - origin)
        return tip, jacobian

    def angles(self, targets: Array, lower: Array, upper: Array) -> Array:
        """Angles (n, J) [rad] within limits (J,) that bring the tip to world points (n, 3) [m], or near them.

        Of many solutions it takes one near the middle of the range: damped least squares, with a pull towards the
        middle that fades.
        """
        middle = 0.5 * (lower + upper)
        q = np.tile(middle, (len(targets), 1))
        pull = 1.0
        for _ in range(_ROUNDS):
            tip, jacobian = self.tips(q)
            miss = targets - tip
            if np.all(np.linalg.norm(miss, axis=1) < _CLOSE):
                break
            step = _least_squares_step(jacobian, miss, pull * (middle - q))
            q = np.clip(q + np.clip(step, -_LONGEST, _LONGEST), lower, upper)
            pull *= _FADING
        return q


def _least_squares_step(jacobian: Array, miss: Array, wish: Array) -> Array:
    """Joint steps (n, J) that take away `miss` (n, 3), and go along `wish` (n, J) where that moves no tip."""
    turned = np.swapaxes(jacobian, 1, 2)
    damping = 1e-7 + 0.1 * np.sum(miss**2, axis=1)
    matrix = jacobian @ turned + damping[:, None, None] * np.eye(3)
    pinned = miss - np.einsum("nij,nj->ni", jacobian, wish)
    solved = np.linalg.solve(matrix, pinned[:, :, None])
    return np.asarray(wish + (turned @ solved)[:, :, 0])


def _about_z(angle: Array) -> Array:
    """Rotations (n, 3, 3) about z by angles (n,) [rad]."""
    turn = np.zeros((len(angle), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -turn[:, 1, 0]
    turn[:, 2, 2] = 1.0
    return turn


def planar_tips(reach: tuple[float, float, float], q: Array) -> Array:
    """Tip centres of a planar finger in the frame of its base (n, 3) [m] for its joint angles (n, 3) [rad]."""
    a, b, c = reach
    planar = np.exp(1j * q[:, 1]) * (a + b * np.exp(1j * q[:, 2]) + c * np.exp(2j * q[:, 2]))
    return np.stack([planar.real * np.cos(q[:, 0]), planar.real * np.sin(q[:, 0]), planar.imag], axis=1)


def planar_angles(reach: tuple[float, float, float], targets: Array) -> Array:
    """Joint angles (n, 3) [rad] that bring a planar finger's tip to points in the frame of its base (n, 3) [m].

    Of the two solutions the flexed one (q3 >= 0) is given. A point out of reach gives the straight or the fully folded
    finger that points at it. Joint limits are not applied.
    """
    q1 = np.arctan2(targets[:, 1], targets[:, 0])
    planar = np.hypot(targets[:, 0], targets[:, 1]) + 1j * targets[:, 2]
    q3 = _flexion(reach, np.abs(planar) ** 2)
    a, b, c = reach
    q2 = np.angle(planar) - np.angle(a + b * np.exp(1j * q3) + c * np.exp(2j * q3))
    return np.stack([q1, q2, q3], axis=1)


def _flexion(reach: tuple[float, float, float], squared_distance: Array) -> Array:
    """q3 >= 0 [rad] from |a + b e + c e^2|^2, a quadratic equation in cos q3."""
    a, b, c = reach
    linear = 2.0 * b * (a + c)
    constant = a * a + b * b + c * c - 2.0 * a * c - squared_distance
    root = np.sqrt(np.maximum(linear**2 - 16.0 * a * c * constant, 0.0))
    return np.arccos(np.clip((root - linear) / (8.0 * a * c), -1.0, 1.0))
