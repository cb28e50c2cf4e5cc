"""Random forces on the cube: sizes and directions redrawn at intervals.

Source: the authors' follow-up (ICRA 2023 page): force N(0.04, 0.008) N, torque N(0.002, 0.0004) N m, every 0.5 s.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.simulation.constants import EpisodeConstants

Array = NDArray[np.float64]


class Disturbance:
    """The force and torque on the cube during an episode, a function of the seed and the time alone."""

    def __init__(self, constants: EpisodeConstants) -> None:
        """Takes sizes, interval and seed from the episode's constants."""
        self._constants = constants

    def wrench(self, time: float) -> Array | None:
        """Force and torque (6,) [N, N m] at a time [s] of the episode, or None without disturbances."""
        c = self._constants
        if not c.disturbed:
            return None
        interval = int(time / c.force_interval + 1e-9)
        rng = np.random.default_rng((c.force_seed, interval))
        force = rng.normal(c.force_mean, c.force_std) * _direction(rng)
        torque = rng.normal(c.torque_mean, c.torque_std) * _direction(rng)
        return np.concatenate([force, torque])


def _direction(rng: np.random.Generator) -> Array:
    """A unit vector, uniform on the sphere (3,)."""
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))
