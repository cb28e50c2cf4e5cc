"""A finger's equations of motion from its kinetic and potential energy alone, as a check on everything compiled."""

from __future__ import annotations

import numpy as np

from tactile_cube.hand import Hand

STEP = 1e-5


def _centres(hand: Hand, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centres of mass (3, 3) [m] in the base frame and angles in the plane (3,) of proximal, middle and distal link."""
    finger = hand.fingers[0]
    a, b, _ = finger.chain.reach
    angles = q[1] + np.array([0.0, q[2], 2.0 * q[2]])
    u = np.exp(1j * angles)
    c = finger.com[1:, 2]
    planar = np.array([c[0] * u[0], a * u[0] + c[1] * u[1], a * u[0] + b * u[1] + c[2] * u[2]])
    return np.stack([planar.real * np.cos(q[0]), planar.real * np.sin(q[0]), planar.imag], axis=1), angles


def _jacobian(hand: Hand, q: np.ndarray) -> np.ndarray:
    columns = [(_centres(hand, q + d)[0] - _centres(hand, q - d)[0]) / (2 * STEP) for d in STEP * np.eye(3)]
    return np.stack(columns, axis=-1)


def mass_matrix(hand: Hand, q: np.ndarray) -> np.ndarray:
    """Inertia that q1, q2, q3 feel (3, 3) [kg m^2], the tendon rigid."""
    M = np.zeros((3, 3))
    finger = hand.fingers[0]
    M[0, 0] = finger.inertia[0, 2]
    turning = np.array([[0, 1, 0], [0, 1, 1], [0, 1, 2]], dtype=float)
    angles = _centres(hand, q)[1]
    for k, (J, turn, angle) in enumerate(zip(_jacobian(hand, q), turning, angles, strict=True), start=1):
        across, _, along = finger.inertia[k]
        M += finger.mass[k] * J.T @ J + across * np.outer(turn, turn)
        M[0, 0] += along * np.sin(angle) ** 2 + across * np.cos(angle) ** 2
    return M


def bias(hand: Hand, q: np.ndarray, v: np.ndarray, gravity: np.ndarray) -> np.ndarray:
    """Coriolis and gravity torques (3,) [N m]; gravity (3,) in the base frame."""
    slopes = [(mass_matrix(hand, q + d) - mass_matrix(hand, q - d)) / (2 * STEP) for d in STEP * np.eye(3)]
    dM = np.stack(slopes)  # dM[k, i, j] = d M_ij / d q_k
    coriolis = np.einsum("kij,j,k->i", dM, v, v) - 0.5 * np.einsum("kij,i,j->k", dM, v, v)
    return coriolis - np.einsum("l,lci,c->i", hand.fingers[0].mass[1:], _jacobian(hand, q), gravity)
