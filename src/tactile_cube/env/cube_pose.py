"""The cube's pose as the task sees it: position, unwrapped turn about the vertical, and tilt."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


class CubePose(NamedTuple):
    """Pose of the cube in the world.

    Attributes:
        x: position of the centre [m].
        y: position of the centre [m].
        z: position of the centre [m].
        theta: angle about the vertical z axis, unwrapped [rad].
        phi: rotation about the y axis [rad].
        psi: rotation about the x axis [rad].
        tilt: angle between the cube's z axis and the vertical [rad].
    """

    x: float
    y: float
    z: float
    theta: float
    phi: float
    psi: float
    tilt: float


def frame_along(axis: Sequence[float] | NDArray[np.float64]) -> Rotation | None:
    """The frame whose z axis is a direction of the world (3,); None for the vertical, which the world's own has."""
    if np.array_equal(axis, (0.0, 0.0, 1.0)):
        return None
    return Rotation.align_vectors([axis], [(0.0, 0.0, 1.0)])[0]


def seen_along(frame: Rotation | None, quaternion: Sequence[float]) -> Sequence[float]:
    """An orientation (4,) x, y, z, w of the world as it is told in `frame`: turning about its z axis changes theta."""
    if frame is None:
        return quaternion
    turned = frame.inv() * Rotation.from_quat(quaternion) * frame
    return [float(part) for part in turned.as_quat()]


def cube_pose(position: Sequence[float], quaternion: Sequence[float], previous_theta: float | None = None) -> CubePose:
    """Pose from a position (3,) [m] and a quaternion (4,) x, y, z, w.

    The rotation is taken apart as Rz(theta) Ry(phi) Rx(psi). Given the theta of the previous step, theta is unwrapped:
    of all angles that differ by whole turns it is the nearest one, right while the cube turns less than half a turn a
    step.
    """
    x, y, z, w = quaternion
    theta = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    if previous_theta is not None:
        theta = previous_theta + math.remainder(theta - previous_theta, 2.0 * math.pi)
    phi = math.asin(min(1.0, max(-1.0, 2.0 * (w * y - z * x))))
    upright = 1.0 - 2.0 * (x * x + y * y)
    psi = math.atan2(2.0 * (w * x + y * z), upright)
    tilt = math.acos(min(1.0, max(-1.0, upright)))
    return CubePose(position[0], position[1], position[2], theta, phi, psi, tilt)
