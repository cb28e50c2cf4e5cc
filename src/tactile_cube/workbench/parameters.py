"""The numbers of a model that a fit may change, and what their user fixes or bounds."""

from dataclasses import dataclass, replace
from typing import Any

from tactile_cube.errors import InputError
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.replay.model import Model

Bounds = tuple[float, float]


@dataclass(frozen=True)
class Value:
    """A number of the model that a fit may change."""

    key: str  # `CONSTANT@JOINT` or `NAME@JOINT.PARAMETER`
    value: float  # in the model in force
    interval: Bounds | None  # 95 %, within the bounds; None where it was set by hand or not fitted
    unit: str  # SI
    unknown: Unknown  # its bounds; `put` gives a model, which `simulate` takes, with another value
    fixed: bool  # whether refits leave it as it is


class BoundedSearch(Search):
    """A search whose refits keep to the user's bounds; arguments are those of `Search`."""

    def __init__(self, *given: Any, **more: Any) -> None:
        self.bounds: dict[str, Bounds] = {}  # key of a number -> smallest and largest value; both alike: it is fixed
        super().__init__(*given, **more)

    def key(self, unknown: Unknown, model: Model) -> str:
        """Name of a number; empty for joint offsets."""
        if unknown.kind == "constant":
            return f"{unknown.key}@{self.fitted.joints[unknown.place]}"
        return f"{model.terms[unknown.place].label}.{unknown.key}" if unknown.kind == "effect" else ""

    def numbers(self, model: Model, bounded: bool = True) -> dict[str, Unknown]:
        """Return what may be changed by name, the fixed numbers among it, within the user's bounds."""
        every = {self.key(one, model): one for one in super().unknowns(model)}
        return {key: self._bounded(key, one) if bounded else one for key, one in every.items() if key}

    def unknowns(self, model: Model) -> tuple[Unknown, ...]:
        """Return everything that a refit of the model may change."""
        every = ((self.key(one, model), one) for one in super().unknowns(model))
        return tuple(self._bounded(key, one) for key, one in every if not self.fixed(key))

    def fixed(self, key: str) -> bool:
        """Return whether refits leave a number as it is."""
        low, high = self.bounds.get(key, (0.0, 1.0))
        return low == high

    def within_bounds(self, model: Model) -> Model:
        """Return the model with every bounded number within its bounds."""
        for key, unknown in self.numbers(model).items():
            low, high = self.bounds.get(key, (unknown.low, unknown.high))
            model = replace(unknown, low=low, high=high).put(model, unknown.of(model))
        return model

    def bound(self, model: Model, key: str, low: float, high: float) -> None:
        """Keep a number within bounds from now on; both alike fix it. Refuses bounds that it cannot have."""
        widest = self.numbers(model, bounded=False)
        if key not in widest:
            raise InputError(f"{key}: no number of the model; it has {', '.join(widest)}")
        if not widest[key].low <= low <= high <= widest[key].high:
            raise InputError(
                f"{key}: bounds {low:g} to {high:g}; give the smaller one first, both within {widest[key].low:g} to "
                f"{widest[key].high:g}"
            )
        self.bounds[key] = low, high

    def _bounded(self, key: str, unknown: Unknown) -> Unknown:
        low, high = self.bounds.get(key, (unknown.low, unknown.high))
        return replace(unknown, low=low, high=high) if low < high else unknown
