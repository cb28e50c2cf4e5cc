"""How far a model's free runs are from trials that it was not fitted to: no refit is taken that is worse there."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.fitting.base import offset_unknowns
from tactile_cube.identification.fitting.gauss_newton import fit
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.measurement.comparing.error import free_run_error
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model

Array = NDArray[np.float64]
ITERATIONS = 3  # that the joint offsets of unseen initialisations take


class HeldOut:
    """Trials to judge by, simulated freely from their measured starts."""

    def __init__(self, shooting: Shooting, trials: Recording, noise: Array, offsets: Mapping[int, Array]) -> None:
        """Take what judges.

        Args:
            shooting: simulates.
            trials: the held-out ones.
            noise: (n,) or (2 n,) of the position sensors [rad].
            offsets: initialisation -> (n,) where those begin that a model does not know [rad].
        """
        self.shooting, self.trials, self.offsets = shooting, trials, offsets
        self.noise = noise

    @cached_property
    def problem(self) -> Problem:
        """By which joint offsets are found."""
        return Problem(self.shooting, self.shooting.cut(self.trials, self.noise))

    def error(self, model: Model) -> float:
        """RMS error of free runs [rad], infinite where one ran away; only unseen joint offsets are fitted."""
        unseen = set(self.offsets) - set(model.offsets)
        found = model.with_offsets(self.offsets)
        if unseen:
            free = [u for u in offset_unknowns(self.trials, self.shooting.sizes) if u.initialisation in unseen]
            self.problem.linearise_starts(found)
            found = fit(self.problem, found, free, ITERATIONS).model
        runs = self.shooting.free_runs([found], self.trials.trials)[0]
        if not all(np.isfinite(run.position).all() for run in runs):
            return float("inf")
        return free_run_error(self.trials, runs).overall

    def worse(self, tried: Model, before: Model, alike: float = STANDARD.least_gain) -> bool:
        """Whether a model does worse than what went before, by more than a part of the squared error."""
        return self.error(tried) ** 2 > (1.0 + alike) * self.error(before) ** 2
