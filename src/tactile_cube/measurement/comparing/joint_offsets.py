"""The joint offsets of each robot initialisation: what nobody knows beforehand and no model can be blamed for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.comparing.error import residuals
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.parameters import Parameters
from tactile_cube.measurement.replay.rig_replay import Engine, Simulated, replay

Array = NDArray[np.float64]
SPREAD = 0.03  # [rad] standard deviation of a joint offset. Source: Sievers et al., ICRA 2022: up to 3 deg
DIFFERENCE = 0.005  # [rad] finite difference
ITERATIONS = 4
LARGEST_OFFSET = 0.15  # [rad] no initialisation is further off; a servo that is mounted a few degrees off is within
LARGEST_STEP = 0.02  # [rad] the simulation is far from linear where joints stick
CORRELATED = 50.0  # samples that the error of a wrong model counts as one


def replay_each(
    recording: Recording, parameters: Parameters, offsets: Mapping[int, Array], engine: Engine, step: float
) -> list[Simulated]:
    """Every trial simulated freely, those of one initialisation with its offset (joints,) [rad]."""
    simulated: dict[int, Simulated] = {}
    for initialisation, offset in offsets.items():
        chosen = [k for k, trial in enumerate(recording.trials) if trial.initialisation == initialisation]
        if chosen:
            part = recording.with_trials([recording.trials[k] for k in chosen])
            simulated |= zip(chosen, replay(part, replace(parameters, offset=offset), engine, step), strict=True)
    return [simulated[k] for k in range(len(recording.trials))]


def no_offsets(recording: Recording) -> dict[int, Array]:
    """No joint offset in any initialisation."""
    return {trial.initialisation: np.zeros(len(recording.joints)) for trial in recording.trials}


def fitted_offsets(recording: Recording, parameters: Parameters, step: float) -> dict[int, Array]:
    """True minus measured angle (joints,) [rad] of each initialisation, by which a model follows its trials best.

    An offset does more than shift the reading: gravity and all that depends on the angle act elsewhere.
    """
    offsets = no_offsets(recording)
    for _ in range(ITERATIONS):
        left = _errors(recording, parameters, offsets, step)
        columns = []
        for joint in range(len(recording.joints)):
            moved = {key: value + DIFFERENCE * _unit(joint, len(value)) for key, value in offsets.items()}
            changed = _errors(recording, parameters, moved, step)
            columns.append([(a - b) / DIFFERENCE for a, b in zip(left, changed, strict=True)])
        tried = {key: _step(recording, key, value, left, columns) for key, value in offsets.items()}
        changed = _errors(recording, parameters, tried, step)
        better = {key: _size(recording, key, changed) < _size(recording, key, left) for key in offsets}
        offsets = {key: tried[key] if better[key] else value for key, value in offsets.items()}
    return offsets


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


def _errors(recording: Recording, parameters: Parameters, offsets: Mapping[int, Array], step: float) -> list[Array]:
    simulated = replay_each(recording, parameters, offsets, "fast", step)
    return [np.nan_to_num(one) for one in residuals(recording.trials, [s.position for s in simulated])]


def _unit(joint: int, joints: int) -> Array:
    return np.asarray(np.eye(joints)[joint])
