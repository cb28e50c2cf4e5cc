"""Where a profile of the missing torque over the position could start: the profile that the residual shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import ANGLE, JOINT_TORQUE, ROWS
from tactile_cube.identification.search.candidates import Candidate, Sizes
from tactile_cube.identification.search.residual_shape import Missing

Array = NDArray[np.float64]
PROFILE = "torque_0"  # first of the control torques by which an effect says that it is a profile over the position
BINS = 120
SMOOTH = 1e-3  # weight of the squared third differences of the control torques, which bins without samples need


def profile_candidates(
    missing_torques: Sequence[Missing], sizes: Sizes, effects: Sequence[type[Effect]]
) -> list[Candidate]:
    """A candidate at every joint for every effect with a profile, started at the mean torque that is missing there."""
    return [
        Candidate(effect, (missing.joint,), start_of(effect, form, missing, sizes[missing.joint]), sizes)
        for effect in effects
        for missing in missing_torques
        for form in effect.forms_at(sizes[missing.joint])
        if PROFILE in form
    ]


def start_of(effect: type[Effect], form: Mapping[str, float], missing: Missing, scales: Scales) -> Mapping[str, float]:
    """Control torques [N m] whose profile is nearest to the missing torque's mean over the position."""
    low, high = scales.low, scales.high
    position = missing.signals[f"position of {missing.joint} [rad]"]
    edges = np.linspace(low, high, BINS + 1)
    place = np.clip(np.searchsorted(edges, position) - 1, 0, BINS - 1)
    count = np.bincount(place, minlength=BINS)
    mean = np.bincount(place, missing.torque, minlength=BINS) / np.maximum(count, 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    basis = np.array([profile_of(effect, effect.placed_at(scales) | {name: 1.0}, middles) for name in form]).T
    weight = count / max(count.sum(), 1)
    bend = np.diff(np.eye(len(form)), n=3, axis=0)
    normal = basis.T @ (weight[:, None] * basis) + SMOOTH / len(form) * bend.T @ bend
    found = np.linalg.lstsq(normal, basis.T @ (weight * mean), rcond=None)[0]
    return {name: float(value) for name, value in zip(form, found, strict=True)}


def profile_of(effect: type[Effect], values: Mapping[str, float], angles: Array) -> Array:
    """Torque (N,) of an effect with these values, all others neutral, at each angle [N m]."""
    known = np.array([values.get(p.name, p.neutral) for p in effect.parameters])
    x = np.zeros((ROWS, 1))
    torques = []
    for angle in angles:
        x[ANGLE, 0], x[JOINT_TORQUE, 0] = angle, 0.0
        torques.append(effect.law(x, 0, known, np.zeros(0), 1.0))
    return np.array(torques)
