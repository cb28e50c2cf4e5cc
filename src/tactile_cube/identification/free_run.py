"""Free-running errors of a model: simulated from each trial's start, constant joint offsets removed."""

from __future__ import annotations

import numpy as np

from tactile_cube.identification.model import Model
from tactile_cube.measurement.error import ErrorSummary, residuals, summarise
from tactile_cube.measurement.parameters import Parameters
from tactile_cube.measurement.recording import Recording
from tactile_cube.measurement.replay import Engine, Simulated, replay


def free_run(recording: Recording, model: Model, engine: Engine, step: float) -> list[Simulated]:
    """Every trial of a recording under a model, each initialisation with its own joint offsets."""
    simulated: dict[int, Simulated] = {}
    effects = tuple((term.label, dict(term.values)) for term in model.terms)
    for initialisation, posture in model.posture.items():
        chosen = [k for k, trial in enumerate(recording.trials) if trial.initialisation == initialisation]
        if chosen:
            part = recording.with_trials([recording.trials[k] for k in chosen])
            parameters = Parameters({k: np.array(v) for k, v in model.constants.items()}, effects, np.array(posture))
            simulated |= zip(chosen, replay(part, parameters, engine, step), strict=True)
    return [simulated[k] for k in range(len(recording.trials))]


def free_run_error(recording: Recording, simulated: list[Simulated]) -> ErrorSummary:
    """RMS error of a free run [rad]."""
    return summarise(residuals(recording.trials, [one.position for one in simulated]), recording.joints)
