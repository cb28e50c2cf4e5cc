"""Simpler laws that a fitted profile over the position looks like: a ripple, a stop or a bias is no arbitrary torque.

A profile with free control torques imitates them all, and its fit converges where theirs, started from the residual of
a model without them, may not. So they start anew from what the profile shows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.effect import Effect, Stage
from tactile_cube.drivetrain.effects.scales import FINGER
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.periodicity import HARMONIC, LOWEST, waves_of
from tactile_cube.identification.search.position_profile import PROFILE, profile_of
from tactile_cube.measurement.replay.model import Term

Array = NDArray[np.float64]
POINTS = 120  # of the profile that are compared
FINEST = 0.8  # highest harmonic in units of what the control torques can carry
EXPLAINED = 0.7  # share of the profile that a simpler law has to explain to be tried


def special_candidates(candidate: Candidate, term: Term, effects: Sequence[type[Effect]]) -> list[Candidate]:
    """Simpler effects whose torque over the position is like a fitted profile.

    Args:
        candidate: the profile at one joint.
        term: its fitted values.
        effects: classes to try.
    """
    if PROFILE not in candidate.form or len(candidate.joints) != 1:
        return []
    angles = np.linspace(term.values["first"], term.values["last"], POINTS)
    torques = profile_of(term.effect, term.values, angles)
    spacing = (angles[-1] - angles[0]) / (len(candidate.form) - 1)
    found = []
    for effect in effects:
        for form in effect.forms_at(candidate.sizes.get(candidate.joints[0], FINGER)):
            if HARMONIC in form and effect.stage is not Stage.POSITION_SENSOR:
                starts = _ripples(angles, torques, form, FINEST * np.pi / spacing)
            elif "stiffness" in form and ("upper" in form or "lower" in form):
                starts = _stops(angles, torques, form, "upper" if "upper" in form else "lower")
            elif tuple(form) == ("bias",):
                starts = _levels(torques)
            else:
                continue
            found += [Candidate(effect, candidate.joints, start, candidate.sizes) for start in starts]
    return found


def _ripples(angles: Array, torques: Array, form: Mapping[str, float], finest: float) -> list[Mapping[str, float]]:
    """The form at the harmonic that explains the profile best, besides a constant and a slope."""
    slow = np.vander(angles - angles.mean(), 2)
    first, second = waves_of(form)
    trials = []
    for harmonic in np.arange(LOWEST, finest, 0.2 / (angles[-1] - angles[0])):
        waves = np.column_stack([np.sin(harmonic * angles), np.cos(harmonic * angles), slow])
        numbers, share = _explained(waves, torques, slow)
        trials.append((share, {**form, first: numbers[0], second: numbers[1], HARMONIC: float(harmonic)}))
    return _best(trials)


def _stops(angles: Array, torques: Array, form: Mapping[str, float], side: str) -> list[Mapping[str, float]]:
    """The form with the edge that explains the profile best, besides a constant."""
    level = np.ones((len(angles), 1))
    sign = 1.0 if side == "upper" else -1.0
    trials = []
    for edge in angles[2:-2]:
        push = -sign * np.maximum(sign * (angles - edge), 0.0)
        numbers, share = _explained(np.column_stack([push, level]), torques, level)
        if numbers[0] > 0.0:
            trials.append((share, {**form, side: float(edge), "stiffness": numbers[0]}))
    return _best(trials)


def _levels(torques: Array) -> list[Mapping[str, float]]:
    """A torque that is the same everywhere."""
    share = 1.0 - float(np.var(torques)) / max(float(np.mean(torques**2)), 1e-15)
    return _best([(share, {"bias": float(torques.mean())})])


def _explained(columns: Array, torques: Array, plain: Array) -> tuple[list[float], float]:
    """Factors of the columns, and the share of the squares that the plain columns leave which they explain."""
    factors = np.linalg.lstsq(columns, torques, rcond=None)[0]
    left = torques - columns @ factors
    before = torques - plain @ np.linalg.lstsq(plain, torques, rcond=None)[0]
    share = 1.0 - float(left @ left) / max(float(before @ before), 1e-15)
    return [float(x) for x in factors], share


def _best(trials: list[tuple[float, dict[str, float]]]) -> list[Mapping[str, float]]:
    share, start = max(trials, key=lambda pair: pair[0], default=(0.0, {}))
    return [start] if share > EXPLAINED else []
