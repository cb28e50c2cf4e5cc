"""Free parameters of a model."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Effect, Scales
from tactile_cube.measurement.comparing.error import LARGEST_OFFSET
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model

Key = TypeVar("Key", str, int)


@dataclass(frozen=True)
class Unknown:
    """Free parameter of a fit.

    Attributes:
        kind: a constant of the drive, a joint offset, or a parameter of an effect.
        key: the constant or the parameter.
        place: joint of a constant or an offset, index of the term of an effect.
        low: smallest value.
        high: largest value.
        scale: size of a noticeable change; finite differences take a part of it.
        initialisation: of a joint offset.
        centre: what is expected beforehand.
        spread: standard deviation of that expectation.
        neutral: value at which an effect's parameter changes nothing.
    """

    kind: Literal["constant", "offset", "effect"]
    key: str
    place: int
    low: float
    high: float
    scale: float
    initialisation: int = 0
    centre: float = 0.0
    spread: float = math.inf
    neutral: float = 0.0

    def of(self, model: Model) -> float:
        """Return its value in a model."""
        if self.kind == "constant":
            return float(model.constants[self.key][self.place])
        if self.kind == "offset":
            return float(model.offsets[self.initialisation][self.place])
        return float(model.terms[self.place].values[self.key])

    def put(self, model: Model, value: float) -> Model:
        """Return the model with another value of this unknown, clipped to the bounds."""
        value = min(max(value, self.low), self.high)
        if self.kind == "constant":
            return replace(model, constants=_changed(model.constants, self.key, self.place, value))
        if self.kind == "offset":
            return replace(model, offsets=_changed(model.offsets, self.initialisation, self.place, value))
        term = model.terms[self.place]
        new = replace(term, values={**term.values, self.key: value})
        return replace(model, terms=(*model.terms[: self.place], new, *model.terms[self.place + 1 :]))


def _changed(arrays: Mapping[Key, Array], key: Key, place: int, value: float) -> dict[Key, Array]:
    changed = arrays[key].copy()
    changed[place] = value
    return {**arrays, key: changed}


def put_all(model: Model, unknowns: tuple[Unknown, ...], values: Array) -> Model:
    """Return the model with all unknowns set to these values."""
    for unknown, value in zip(unknowns, values, strict=True):
        model = unknown.put(model, float(value))
    return model


def read_all(model: Model, unknowns: tuple[Unknown, ...]) -> Array:
    """Return the values (P,) of the unknowns in a model."""
    return np.array([unknown.of(model) for unknown in unknowns])


TOLERANCE = {
    "kd": (0.75, 1.3),
    "static_friction": (0.5, 1.6),
    "reflected_inertia": (0.6, 1.6),
    "stiffness": (0.8, 1.25),
}
"""Part of the nominal value at which a constant still counts as the nominal one; more is an effect that is missing."""
MEASURED, UNKNOWN = (0.2, 5.0), (0.02, 50.0)
SPREAD = 0.12  # relative standard deviation of a true constant about its nominal value
OFFSET, OFFSET_SPREAD = 0.05, 0.01  # [rad] of a finger
READING_SPREAD = 0.3  # rows: as if a reading came at any time within half a row of its stamp
CREEP, CREEP_SPREAD, LARGEST_CREEP = 0.05, 0.1, 1.0  # [rad/s per N m] where friction is regularised


def every_effect(effects: Sequence[type[Effect]], start: Model) -> tuple[type[Effect], ...]:
    """Return the effect classes to compile: those to try, and those of the start model."""
    return tuple(dict.fromkeys([*effects, *(term.effect for term in start.terms)]))


def tolerance(recording: Recording) -> dict[str, tuple[float, float]]:
    """Return the bounds relative to the nominal values; wide for what a bench trial of the recording measures directly.

    Source: Sievers et al., ICRA 2022, II-D: K_P from a known force on a static finger, K_e from clamped links.
    """
    wide = {}
    if any(trial.force is not None for trial in recording.trials):
        wide["kp"] = MEASURED
    if any(trial.clamped for trial in recording.trials):
        wide["stiffness"] = MEASURED
    unknown = [key for key in recording.description.unknown if key != "mass"]  # which is an effect's
    return TOLERANCE | wide | dict.fromkeys(unknown, UNKNOWN)


def base_unknowns(
    recording: Recording, nominal: Mapping[str, Array], sizes: Mapping[str, Scales]
) -> tuple[Unknown, ...]:
    """Return the constants that a refit may change, about `nominal`, and the joint offsets of each initialisation."""
    joints = range(len(recording.joints))
    constants = [
        _around_nominal(key, j, float(nominal[key][j]), low, high, key in recording.description.unknown)
        for key, (low, high) in tolerance(recording).items()
        for j in joints
        if 0.0 < nominal[key][j] < np.inf
    ]
    softness = [sizes[joint].of("rad/s") / sizes[joint].of("N m") for joint in recording.joints]
    creeps = [
        Unknown("constant", "friction_creep", j, 0.0, one * LARGEST_CREEP, one * CREEP, spread=one * CREEP_SPREAD)
        for j, one in enumerate(softness)
        if nominal["static_friction"][j] > 0.0
    ]
    row, spread = recording.step, READING_SPREAD * recording.step  # never exact, and what is a row late is a delay
    delays = [Unknown("constant", "reading_delay", j, -row, row, 0.1 * row, spread=spread) for j in joints]
    return (*constants, *creeps, *delays, *offset_unknowns(recording, sizes))


def offset_unknowns(recording: Recording, sizes: Mapping[str, Scales]) -> tuple[Unknown, ...]:
    """Return the joint offsets of each initialisation of a recording as unknowns."""
    initialisations = sorted({trial.initialisation for trial in recording.trials})
    angles = [sizes[joint].of("rad") for joint in recording.joints]
    return tuple(
        Unknown("offset", "offset", j, -most, most, size * OFFSET, initialisation, spread=size * OFFSET_SPREAD)
        for initialisation in initialisations
        for j, (size, most) in enumerate((size, size * LARGEST_OFFSET) for size in angles)
    )


def _around_nominal(key: str, joint: int, nominal: float, low: float, high: float, unknown: bool) -> Unknown:
    spread = (high if unknown else SPREAD) * nominal
    return Unknown("constant", key, joint, nominal * low, nominal * high, 0.2 * nominal, centre=nominal, spread=spread)
