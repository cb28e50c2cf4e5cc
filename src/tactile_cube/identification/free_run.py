"""Free-running errors of a model: simulated from each trial's start, constant joint offsets removed."""

from __future__ import annotations

import numpy as np

from tactile_cube.identification.fitting.model import Model
from tactile_cube.measurement.comparing.error import ErrorSummary, residuals, summarise
from tactile_cube.measurement.comparing.joint_offsets import replay_each
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.parameters import Parameters
from tactile_cube.measurement.replay.rig_replay import Engine, Simulated


def free_run(recording: Recording, model: Model, engine: Engine, step: float) -> list[Simulated]:
    """Every trial of a recording under a model, each initialisation with its own joint offsets."""
    effects = tuple((term.label, dict(term.values)) for term in model.terms)
    constants = {key: np.array(value) for key, value in model.constants.items()}
    parameters = Parameters(constants, effects, np.zeros(len(recording.joints)))
    return replay_each(recording, parameters, model.offsets, engine, step)


def free_run_error(recording: Recording, simulated: list[Simulated]) -> ErrorSummary:
    """RMS error of a free run [rad]."""
    return summarise(residuals(recording.trials, [one.position for one in simulated]), recording.joints)
