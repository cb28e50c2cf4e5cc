"""From easy to hard: the conditions between the start and the end of a curriculum."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from tactile_cube.env import Conditions
from tactile_cube.errors import InputError


@dataclass(frozen=True)
class Ramps(ABC):
    """Where each condition starts; it ends, linearly in the progress, at the task's own value.

    Attributes:
        filter_time: T_s at the start [s]; None leaves the task's value throughout.
        gravity_scale: part of the cube's weight at the start; None leaves the task's value throughout.
        penalty_scale: factor on the weights of height, plane and tilt at the start; 1 at the end.
    """

    filter_time: float | None = 0.12
    gravity_scale: float | None = 0.05
    penalty_scale: float = 1.0

    def __post_init__(self) -> None:
        """Refuses values without a meaning."""
        if self.filter_time is not None and not self.filter_time > 0.0:
            raise InputError(f"curriculum filter_time is {self.filter_time} s; give a time constant above 0")
        for key in ("gravity_scale", "penalty_scale"):
            value = getattr(self, key)
            if value is not None and not value >= 0.0:
                raise InputError(f"curriculum {key} is {value}; give a scale >= 0")

    @abstractmethod
    def progress(self, environment_steps: int, performance: float) -> float:
        """Part of the way to the task's own conditions; below 0 it has not begun, above 1 it is over."""

    def conditions(self, environment_steps: int, performance: float, final: Conditions) -> Conditions:
        """Conditions of the episodes that start now, see `Curriculum`."""
        progress = min(1.0, max(0.0, self.progress(environment_steps, performance)))
        return Conditions(
            filter_time=_between(self.filter_time, final.filter_time, progress),
            gravity_scale=_between(self.gravity_scale, final.gravity_scale, progress),
            penalty_scale=_between(self.penalty_scale, final.penalty_scale, progress),
        )


def _between(start: float | None, end: float, progress: float) -> float:
    return end if start is None else start + progress * (end - start)


class NoCurriculum:
    """The task's own conditions from the first step."""

    def __init__(self, **unused: object) -> None:
        """Takes no account of what an experiment sets for a curriculum, so that `curriculum=none` ends any of them."""

    def conditions(self, environment_steps: int, performance: float, final: Conditions) -> Conditions:
        """`final`, whatever has been learned."""
        return final


@dataclass(frozen=True)
class LinearCurriculum(Ramps):
    """Conditions that change with the number of environment steps. Source: website, table of the learning parameters.

    Attributes:
        begin: environment steps after which the conditions begin to change.
        length: environment steps that the change takes.
    """

    begin: float = 2e6
    length: float = 4e6

    def __post_init__(self) -> None:
        """Refuses values without a meaning."""
        super().__post_init__()
        if not (self.begin >= 0.0 and self.length > 0.0):
            raise InputError(f"curriculum begin {self.begin}, length {self.length}; give begin >= 0 and length > 0")

    def progress(self, environment_steps: int, performance: float) -> float:
        """Goes by the steps."""
        return (environment_steps - self.begin) / self.length


@dataclass(frozen=True)
class PerformanceCurriculum(Ramps):
    """Conditions that follow the policy's mean final angle, up and down again.

    They are a function of the present performance alone, without memory: they become easier by themselves when the
    policy gets worse, and a resumed training needs nothing but its performance to continue with them.

    Attributes:
        low: mean final angle up to which the conditions stay at the start [rad].
        high: mean final angle from which on they are the task's own [rad].
    """

    low: float = 1.6
    high: float = 4.0

    def __post_init__(self) -> None:
        """Refuses values without a meaning."""
        super().__post_init__()
        if not self.low < self.high:
            raise InputError(f"curriculum low {self.low} is not below high {self.high}; give angles low < high [rad]")

    def progress(self, environment_steps: int, performance: float) -> float:
        """Goes by the performance."""
        return (performance - self.low) / (self.high - self.low)
