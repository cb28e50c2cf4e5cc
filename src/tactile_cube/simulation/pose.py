"""Poses in the hand's frame and in the world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.hand import HandModel

Array = NDArray[np.float64]


def to_world(hand: HandModel, position: Array, quaternion: Array) -> tuple[Array, Array]:
    """Position (3,) [m] and quaternion xyzw (4,) in the world of a pose given in the hand's frame."""
    turned = Rotation.from_matrix(hand.rotation) * Rotation.from_quat(np.array(quaternion))
    return hand.position + hand.rotation @ position, np.asarray(turned.as_quat())


def to_hand(hand: HandModel, position: Array, quaternion: Array) -> tuple[Array, Array]:
    """Position (3,) [m] and quaternion xyzw (4,) in the hand's frame of a pose given in the world."""
    turned = Rotation.from_matrix(hand.rotation.T) * Rotation.from_quat(np.array(quaternion))
    return hand.rotation.T @ (position - hand.position), np.asarray(turned.as_quat())
