"""Distributions as values: a configuration names them, an episode draws from them.

A distribution is known by its quantile function, so one uniform number drawn anywhere (numpy in a world, torch in a
transform) becomes one draw.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects import Effect
from tactile_cube.errors import InputError

Array = NDArray[np.float64]


@runtime_checkable
class Distribution(Protocol):
    """A random quantity, given by its quantile function."""

    def quantile(self, u: Array) -> Array:
        """The values below which the fractions `u` in [0, 1) of all draws lie, same shape as `u`."""


def sample(distribution: Distribution, rng: np.random.Generator, shape: tuple[int, ...] = ()) -> Array:
    """Independent draws of `shape`."""
    return distribution.quantile(rng.random(shape))


@dataclass(frozen=True)
class Constant:
    """Always `value`."""

    value: float

    def quantile(self, u: Array) -> Array:
        """`value` in the shape of `u`."""
        return np.full(np.shape(u), self.value)


@dataclass(frozen=True)
class Uniform:
    """Equally likely everywhere in [low, high)."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low <= self.high:
            raise InputError(f"Uniform: low {self.low} is above high {self.high}; give low <= high")

    def quantile(self, u: Array) -> Array:
        """Linear between the bounds."""
        return self.low + (self.high - self.low) * np.asarray(u)


@dataclass(frozen=True)
class UniformPerJoint:
    """Equally likely between bounds of each joint's own, low (joints,) and high (joints,)."""

    low: tuple[float, ...]
    high: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.low) != len(self.high) or not np.all(np.asarray(self.low) <= np.asarray(self.high)):
            raise InputError(f"UniformPerJoint: low {self.low} and high {self.high}; give low <= high for each joint")

    def quantile(self, u: Array) -> Array:
        """Linear between the bounds; the last axis of `u` is the joints'."""
        low, high = np.asarray(self.low), np.asarray(self.high)
        return np.asarray(low + (high - low) * np.asarray(u))


@dataclass(frozen=True)
class Choice:
    """One of `values`, all equally likely."""

    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if not len(self.values):
            raise InputError("Choice: values is empty; give at least one number")

    def quantile(self, u: Array) -> Array:
        """The value in whose equal share of [0, 1) each number of `u` lies."""
        values = np.asarray(self.values, dtype=np.float64)
        return np.asarray(values[(np.asarray(u) * len(values)).astype(np.int64)])


@dataclass(frozen=True)
class LogUniform:
    """Equally likely in every factor: the logarithm is uniform in [log low, log high)."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not 0.0 < self.low <= self.high:
            raise InputError(f"LogUniform: needs 0 < low <= high, got low {self.low}, high {self.high}")

    def quantile(self, u: Array) -> Array:
        """Geometric between the bounds."""
        return np.asarray(self.low * (self.high / self.low) ** np.asarray(u), dtype=np.float64)


@dataclass(frozen=True)
class EffectRange:
    """One effect at one joint, e.g. `ring_q2`; each episode draws its parameters, in SI units.

    Not for effects that change the mechanism, whose bodies are built once.
    """

    effect: type[Effect]
    joint: str
    parameters: Mapping[str, Distribution]

    def draw(self, rng: np.random.Generator) -> Effect:
        """The effect of one episode."""
        return self.effect(self.joint, **{key: float(sample(one, rng)) for key, one in self.parameters.items()})
