"""What changes while learning goes on: filter time, weight of the cube, size of the penalties."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, Self


@dataclass(frozen=True)
class Conditions:
    """Conditions that an episode starts with and keeps to its end.

    Attributes:
        filter_time: T_s, time constant of the low-pass that turns q_n into q_f [s].
        gravity_scale: part of the cube's weight that acts.
        penalty_scale: factor on the weights of height, plane and tilt.
    """

    filter_time: float
    gravity_scale: float
    penalty_scale: float

    def columns(self) -> dict[str, float]:
        """By the names that they have in logs: "T_s" [s], "gravity" and "penalty" (scales)."""
        return {"T_s": self.filter_time, "gravity": self.gravity_scale, "penalty": self.penalty_scale}

    @classmethod
    def from_columns(cls, columns: Mapping[str, float]) -> Self:
        """What `columns` gave; further columns, as a row of metrics has, are passed over.

        Raises:
            KeyError: a column is missing.
        """
        return cls(columns["T_s"], columns["gravity"], columns["penalty"])


class Curriculum(Protocol):
    """Gives the conditions for the episodes that start now."""

    def conditions(self, environment_steps: int, performance: float, final: Conditions) -> Conditions:
        """Conditions after `environment_steps` with mean final angle `performance` [rad] on the way to `final`."""
