"""One trial with an object beside its simulation, with what nobody knows of it fitted: offsets and the box's place.

Where a fingertip first touches decides how hard it presses later, and joint offsets of a degree move it by millimetres.
So every value of a contact effect is judged with the offsets and the place that suit it best.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.hand_replay import Contact, HandReplay
from tactile_cube.measurement.trial import Trial

Array = NDArray[np.float64]
OFFSET = 0.02  # [rad] standard deviation of a joint offset; the paper's initialisations differ by degrees
PLACING = 1e-3  # [m] with which somebody puts the box in its place
SIGMA = 1e-3  # [rad] error that the world leaves in contact: drives known to 10 %, a solver that stops early
WIDTHS = (4e-3, 4e-4)  # [rad], [m] finite steps, wide against the roughness of contact
EVERY = 3  # rows of a trial that are compared; neighbours say the same
ITERATIONS = 2  # steps with the same slopes
HALVINGS = (1.0, 0.5, 0.25)


class ContactTrial:
    """A trial, and the unknowns that belong to it alone.

    Attributes:
        trial: what was measured.
        nuisance: joint offsets (joints,) [rad] and displacement of the box in the rig's frame (3,) [m].
    """

    def __init__(self, replay: HandReplay, trial: Trial) -> None:
        """Begins without offsets."""
        assert trial.load is not None, "a trial with an object"
        self.trial, self._replay, self._load = trial, replay, trial.load
        joints = trial.position.shape[1]
        self._spread = np.r_[np.full(joints, OFFSET), np.full(3, PLACING)]
        self._width = np.r_[np.full(joints, WIDTHS[0]), np.full(3, WIDTHS[1])]
        self.nuisance = np.zeros(joints + 3)
        self._slopes: Array | None = None
        released = round(trial.load.released / trial.step)
        self._grip = released if released >= EVERY else len(trial.time)

    def settle(self, contact: Contact, rounds: int = 2) -> None:
        """Fit the nuisance under some values of the contact; later costs start from it and use its slopes."""
        for _ in range(rounds):
            self._slopes = self._gradients(contact, self._target(contact, self.nuisance))
            self.nuisance = self._fitted_nuisance(contact)

    def cost(self, contact: Contact) -> float:
        """Mean square of the residual over SIGMA^2, plus what improbable offsets cost, the nuisance fitted."""
        nuisance = self._fitted_nuisance(contact)
        residual = self._residual(contact, nuisance)[self.trial.valid][::EVERY] / SIGMA
        prior = nuisance / self._spread
        return float((np.sum(residual**2) + np.sum(prior**2)) / residual.size)

    def residual(self, contact: Contact) -> Array:
        """Measured minus simulated position (n, joints) [rad], the nuisance fitted."""
        return self._residual(contact, self._fitted_nuisance(contact))

    def _residual(self, contact: Contact, nuisance: Array) -> Array:
        return np.asarray(self.trial.position - self._simulate(contact, nuisance, len(self.trial.time)))

    def _fitted_nuisance(self, contact: Contact) -> Array:
        """Gauss-Newton steps on the time before the box has weight, when nothing can slip yet."""
        nuisance, target = self.nuisance, self._target(contact, self.nuisance)
        if self._slopes is None:
            self._slopes = self._gradients(contact, target)
        for _ in range(ITERATIONS):
            step = -np.linalg.lstsq(self._slopes, target, rcond=None)[0]
            for share in HALVINGS:
                tried = self._target(contact, nuisance + share * step)
                if tried @ tried < target @ target:
                    nuisance, target = nuisance + share * step, tried
                    break
            else:
                break
        return nuisance

    def _target(self, contact: Contact, nuisance: Array) -> Array:
        grip = self._simulate(contact, nuisance, self._grip) - self.trial.position[: self._grip]
        return np.concatenate([grip[::EVERY].ravel() / SIGMA, nuisance / self._spread])

    def _gradients(self, contact: Contact, target: Array) -> Array:
        steps = np.diag(self._width)
        columns = [(self._target(contact, self.nuisance + step) - target) / step.max() for step in steps]
        return np.stack(columns, axis=1)

    def _simulate(self, contact: Contact, nuisance: Array, rows: int) -> Array:
        moved = replace(self._load, position=self._load.position + nuisance[-3:])
        trial = replace(self.trial, load=moved)
        return self._replay.simulate(trial, contact, nuisance[:-3], rows * self.trial.step).position
