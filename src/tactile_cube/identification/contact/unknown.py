"""A parameter of a contact effect that is to be found, and where to look for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.measurement.replay.hand_replay import ContactModel
from tactile_cube.simulation.contact_effects import ContactEffect

Array = NDArray[np.float64]
COARSE, RATIO = 5, 2.3  # least number of values of a first grid; the largest ratio of neighbours


@dataclass(frozen=True)
class ContactUnknown:
    """One parameter of one effect.

    Attributes:
        effect: class of the effect.
        parameter: which of its numbers.
    """

    effect: type[ContactEffect]
    parameter: Parameter

    @property
    def label(self) -> str:
        """For people."""
        one = len(self.effect.parameters) == 1
        return self.effect.name if one else f"{self.effect.name} {self.parameter.name}"

    @property
    def by_factors(self) -> bool:
        """Whether equal factors matter, and not equal differences."""
        return self.parameter.low > 0

    def grid(self) -> Array:
        """Coarse values over all its range."""
        low, high = self.parameter.low, self.parameter.high
        if not self.by_factors:
            return np.linspace(low, high, COARSE)
        count = max(COARSE, int(np.ceil(np.log(high / low) / np.log(RATIO))) + 1)
        return np.asarray(np.geomspace(low, high, count))

    @property
    def spacing(self) -> float:
        """Between neighbours of the grid, on the scale of `scaled`."""
        first, second = self.grid()[:2]
        return self.scaled(float(second)) - self.scaled(float(first))

    def scaled(self, value: float) -> float:
        """The value on the scale in which it is averaged."""
        return float(np.log(value)) if self.by_factors else value

    def unscaled(self, value: float) -> float:
        """The inverse of `scaled`, within the bounds."""
        plain = float(np.exp(value)) if self.by_factors else value
        return float(np.clip(plain, self.parameter.low, self.parameter.high))

    def put(self, contact: ContactModel, value: float) -> ContactModel:
        """The contact with this parameter at a value."""
        return contact.changed(self.effect.name, **{self.parameter.name: value})


def contact_unknowns(effects: list[type[ContactEffect]]) -> list[ContactUnknown]:
    """Every parameter of some effects."""
    return [ContactUnknown(effect, parameter) for effect in effects for parameter in effect.parameters]
