"""The joint offsets of each robot initialisation: what nobody knows beforehand and no model can be blamed for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.comparing.error import residuals
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.simulator import Simulator

Array = NDArray[np.float64]
SPREAD = 0.03  # [rad] standard deviation of a joint offset. Source: Sievers et al., ICRA 2022: up to 3 deg
DIFFERENCE = 0.005  # [rad] finite difference
ITERATIONS = 4
LARGEST_OFFSET = 0.15  # [rad] no initialisation is further off; a servo that is mounted a few degrees off is within
LARGEST_STEP = 0.02  # [rad] the simulation is far from linear where joints stick
CORRELATED = 50.0  # samples that the error of a wrong model counts as one


def with_fitted_offsets(simulator: Simulator, model: Model) -> Model:
    """The model with the joint offsets of each initialisation by which it follows its trials best, from none at all.

    An offset does more than shift the reading: gravity and all that depends on the angle act elsewhere.
    """
    recording = simulator.recording
    model = replace(model, offsets={key: np.zeros_like(value) for key, value in model.offsets.items()})
    for _ in range(ITERATIONS):
        moved = [_moved(model, joint) for joint in range(len(recording.joints))]
        left, *changed = _errors(simulator, [model, *moved])
        columns = [[(a - b) / DIFFERENCE for a, b in zip(left, one, strict=True)] for one in changed]
        tried = {key: _step(recording, key, value, left, columns) for key, value in model.offsets.items()}
        (after,) = _errors(simulator, [replace(model, offsets=tried)])
        better = {key: _size(recording, key, after) < _size(recording, key, left) for key in tried}
        model = replace(model, offsets={key: tried[key] if better[key] else model.offsets[key] for key in tried})
    return model


def _moved(model: Model, joint: int) -> Model:
    unit = np.eye(len(model.constants["kp"]))[joint]
    return replace(model, offsets={key: value + DIFFERENCE * unit for key, value in model.offsets.items()})


def _step(
    recording: Recording, initialisation: int, offset: Array, left: list[Array], columns: list[list[Array]]
) -> Array:
    """A cautious Gauss-Newton step of one initialisation's offset (joints,) [rad]."""
    error = _stacked(recording, initialisation, left)
    slopes = np.stack([_stacked(recording, initialisation, one) for one in columns], axis=1)
    trust = CORRELATED * float(np.mean(error**2)) / SPREAD**2
    normal = slopes.T @ slopes + trust * np.eye(len(offset))
    step = np.linalg.solve(normal, slopes.T @ error - trust * offset)
    return np.asarray(np.clip(offset + np.clip(step, -LARGEST_STEP, LARGEST_STEP), -LARGEST_OFFSET, LARGEST_OFFSET))


def _stacked(recording: Recording, initialisation: int, arrays: list[Array]) -> Array:
    rows = [k for k, trial in enumerate(recording.trials) if trial.initialisation == initialisation]
    return np.concatenate([arrays[k].ravel() for k in rows])


def _size(recording: Recording, initialisation: int, errors: list[Array]) -> float:
    return float(np.sum(_stacked(recording, initialisation, errors) ** 2))


def _errors(simulator: Simulator, models: Sequence[Model]) -> list[list[Array]]:
    trials = simulator.recording.trials
    return [
        [np.nan_to_num(one) for one in residuals(trials, [simulated.position for simulated in runs])]
        for runs in simulator.free_runs(models)
    ]
