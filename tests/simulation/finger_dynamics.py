"""A finger's equations of motion from its kinetic and potential energy alone, as a check on everything compiled."""

from __future__ import annotations

import numpy as np

from tactile_cube.hand import HandModel

STEP = 1e-5


def _centres(hand: HandModel, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centres of mass (3, 3) [m] in the base frame and angles in the plane (3,) of proximal, middle and distal link."""
    a, b, _ = hand.tip_reach
    angles = q[1] + np.array([0.0, q[2], 2.0 * q[2]])
    u = np.exp(1j * angles)
    c = [link.centre_of_mass for link in hand.links[1:]]
    planar = np.array([c[0] * u[0], a * u[0] + c[1] * u[1], a * u[0] + b * u[1] + c[2] * u[2]])
    return np.stack([planar.real * np.cos(q[0]), planar.real * np.sin(q[0]), planar.imag], axis=1), angles


def _jacobian(hand: HandModel, q: np.ndarray) -> np.ndarray:
    columns = [(_centres(hand, q + d)[0] - _centres(hand, q - d)[0]) / (2 * STEP) for d in STEP * np.eye(3)]
    return np.stack(columns, axis=-1)


def mass_matrix(hand: HandModel, q: np.ndarray) -> np.ndarray:
    """Inertia that q1, q2, q3 feel (3, 3) [kg m^2], the tendon rigid."""
    M = np.zeros((3, 3))
    M[0, 0] = hand.links[0].inertia()[2]
    turning = np.array([[0, 1, 0], [0, 1, 1], [0, 1, 2]], dtype=float)
    angles = _centres(hand, q)[1]
    for link, J, turn, angle in zip(hand.links[1:], _jacobian(hand, q), turning, angles, strict=True):
        across, _, along = link.inertia()
        M += link.mass * J.T @ J + across * np.outer(turn, turn)
        M[0, 0] += along * np.sin(angle) ** 2 + across * np.cos(angle) ** 2
    return M


def bias(hand: HandModel, q: np.ndarray, v: np.ndarray, gravity: np.ndarray) -> np.ndarray:
    """Coriolis and gravity torques (3,) [N m]; gravity (3,) in the base frame."""
    slopes = [(mass_matrix(hand, q + d) - mass_matrix(hand, q - d)) / (2 * STEP) for d in STEP * np.eye(3)]
    dM = np.stack(slopes)  # dM[k, i, j] = d M_ij / d q_k
    coriolis = np.einsum("kij,j,k->i", dM, v, v) - 0.5 * np.einsum("kij,i,j->k", dM, v, v)
    masses = np.array([link.mass for link in hand.links[1:]])
    return coriolis - np.einsum("l,lci,c->i", masses, _jacobian(hand, q), gravity)
