"""Fingertips from joint angles and back: for any chain of revolute joints, and in closed form for the DLR-Hand II."""

from dataclasses import dataclass

import numpy as np

from tactile_cube.hand.urdf import Array

_ROUNDS = 40  # steps of the search; from the middle of the range, points within reach take five to fifteen
_CLOSE = 1e-7  # A tip this near to its target is there [m]
_LONGEST = 0.3  # longest step of a joint in one round [rad]
_FADING = 0.7  # how much of the pull towards the middle of the range is left after each round


@dataclass(frozen=True)
class Chain:
    """L joints in a row, each turning about z of its frame, of which some move with an actuated one.

    Attributes:
        rotations: frame of each further joint in the frame of the link before it (L - 1, 3, 3).
        translations: likewise (L - 1, 3) [m].
        columns: the actuated joint that each joint moves with (L,).
        tip: middle of the fingertip in the last link's frame (3,) [m].
    """

    rotations: Array
    translations: Array
    columns: tuple[int, ...]
    tip: Array

    def tips(self, position: Array, rotation: Array, q: Array) -> Array:
        """Return the tip in the world (n, 3) [m] for angles q (n, J) [rad], the first frame at `position` (3,) [m]."""
        return self.motion(position, rotation, q)[0]

    def motion(self, position: Array, rotation: Array, q: Array) -> tuple[Array, Array]:
        """Return the tip in the world (n, 3) [m] and its velocity per joint velocity (n, 3, J)."""
        count = len(q)
        place, turn = np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3))
        translations, rotations = (position, *self.translations), (rotation, *self.rotations)
        origins, axes = [], []
        for shift, frame, column in zip(translations, rotations, self.columns, strict=True):
            place = place + turn @ shift
            turn = turn @ frame
            origins.append(place)
            axes.append(turn[:, :, 2])
            turn = turn @ _about_z(q[:, column])
        tip = place + turn @ self.tip
        jacobian = np.zeros((count, 3, q.shape[1]))
        for origin, axis, column in zip(origins, axes, self.columns, strict=True):
            jacobian[:, :, column] += np.cross(axis, tip - origin)
        return tip, jacobian

    def angles(self, position: Array, rotation: Array, targets: Array, lower: Array, upper: Array) -> Array:
        """Return angles (n, J) [rad] within limits (J,) that bring the tip to world points (n, 3) [m], or near them.

        Of many solutions it takes one near the middle of the range: damped least squares, with a pull towards the
        middle that fades.
        """
        middle = 0.5 * (lower + upper)
        q = np.tile(middle, (len(targets), 1))
        pull = 1.0
        for _ in range(_ROUNDS):
            tip, jacobian = self.motion(position, rotation, q)
            miss = targets - tip
            if np.all(np.linalg.norm(miss, axis=1) < _CLOSE):
                break
            step = _least_squares_step(jacobian, miss, pull * (middle - q))
            q = np.clip(q + np.clip(step, -_LONGEST, _LONGEST), lower, upper)
            pull *= _FADING
        return q


def _least_squares_step(jacobian: Array, miss: Array, wish: Array) -> Array:
    """Return joint steps (n, J) that take away `miss` (n, 3), and go along `wish` (n, J) where that moves no tip."""
    turned = np.swapaxes(jacobian, 1, 2)
    damping = 1e-7 + 0.1 * np.sum(miss**2, axis=1)
    matrix = jacobian @ turned + damping[:, None, None] * np.eye(3)
    pinned = miss - np.einsum("nij,nj->ni", jacobian, wish)
    solved = np.linalg.solve(matrix, pinned[:, :, None])
    return np.asarray(wish + (turned @ solved)[:, :, 0])


def _about_z(angle: Array) -> Array:
    """Return the rotations (n, 3, 3) about z by angles (n,) [rad]."""
    turn = np.zeros((len(angle), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -turn[:, 1, 0]
    turn[:, 2, 2] = 1.0
    return turn


@dataclass(frozen=True)
class PlanarChain:
    """A finger that is planar behind q1, and whose last joint follows q3.

    With e = exp(i q3) the tip's centre lies at exp(i q2) (a + b e + c e^2) in the plane that q1 turns about the base's
    z axis.

    Attributes:
        reach: distances a, b, c: q2-q3, q3-q4 and q4-centre of the fingertip's sphere [m].
    """

    reach: tuple[float, float, float]

    def tips(self, position: Array, rotation: Array, q: Array) -> Array:
        """See `Chain.tips`; position (n, 3) and rotation (n, 3, 3) may also differ from row to row."""
        a, b, c = self.reach
        planar = np.exp(1j * q[:, 1]) * (a + b * np.exp(1j * q[:, 2]) + c * np.exp(2j * q[:, 2]))
        local = np.stack([planar.real * np.cos(q[:, 0]), planar.real * np.sin(q[:, 0]), planar.imag], axis=1)
        return np.asarray(position + (local[:, None] @ np.swapaxes(rotation, -1, -2))[:, 0])

    def angles(self, position: Array, rotation: Array, targets: Array, lower: Array, upper: Array) -> Array:
        """Return the angles (n, 3) [rad] that bring the tip to world points (n, 3) [m]; limits are not applied.

        Of the two solutions the flexed one (q3 >= 0) is given. A point out of reach gives the straight or the fully
        folded finger that points at it.
        """
        a, b, c = self.reach
        local = (targets - position) @ rotation
        planar = np.hypot(local[:, 0], local[:, 1]) + 1j * local[:, 2]
        # |a + b e + c e^2| is known: a quadratic equation in cos q3
        linear = 2.0 * b * (a + c)
        constant = a * a + b * b + c * c - 2.0 * a * c - np.abs(planar) ** 2
        root = np.sqrt(np.maximum(linear**2 - 16.0 * a * c * constant, 0.0))
        q3 = np.arccos(np.clip((root - linear) / (8.0 * a * c), -1.0, 1.0))
        q2 = np.angle(planar) - np.angle(a + b * np.exp(1j * q3) + c * np.exp(2j * q3))
        return np.stack([np.arctan2(local[:, 1], local[:, 0]), q2, q3], axis=1)
