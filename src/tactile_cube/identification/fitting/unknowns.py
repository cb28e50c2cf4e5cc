"""The numbers of a model that are fitted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.replay.model import Model

Array = NDArray[np.float64]
Key = TypeVar("Key", str, int)


@dataclass(frozen=True)
class Unknown:
    """A number that is fitted.

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
        """Its value in a model."""
        if self.kind == "constant":
            return float(model.constants[self.key][self.place])
        if self.kind == "offset":
            return float(model.offsets[self.initialisation][self.place])
        return float(model.terms[self.place].values[self.key])

    def put(self, model: Model, value: float) -> Model:
        """The model with another value, kept within the bounds."""
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
    """The model with all unknowns set."""
    for unknown, value in zip(unknowns, values, strict=True):
        model = unknown.put(model, float(value))
    return model


def read_all(model: Model, unknowns: tuple[Unknown, ...]) -> Array:
    """Values (P,) of the unknowns in a model."""
    return np.array([unknown.of(model) for unknown in unknowns])
