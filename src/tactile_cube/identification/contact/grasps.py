"""The trials in which the hand holds an object, open for simulation: those that are fitted, and those that judge."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.contact.trial import SIGMA, ContactTrial
from tactile_cube.measurement.bench import with_object
from tactile_cube.measurement.comparing.noise_floor import sensor_noise
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.hand_replay import ContactModel, HandReplay, contact_of
from tactile_cube.measurement.replay.nominal import nominal_model
from tactile_cube.measurement.split import held_out_split


@dataclass(frozen=True)
class GraspTrials:
    """What a contact is fitted to and judged by.

    Attributes:
        joints: of the rig.
        fitted: trials that are fitted.
        held_out: trials that judge.
        start: the contact as the model has it.
        noise_floor: noise of the position sensors, and what a world with the true effects leaves [rad].
    """

    joints: tuple[str, ...]
    fitted: list[ContactTrial]
    held_out: list[ContactTrial]
    start: ContactModel
    noise_floor: float


@contextmanager
def open_grasps(recording: Recording, model: ModelFile | None, step: float, seed: int) -> Iterator[GraspTrials]:
    """Open the world that training uses for the trials with an object, and close it afterwards.

    Args:
        recording: trials without an object are left aside.
        model: of the drivetrain, taken as known; None: as recording.yaml states it.
        step: longest physics step [s].
        seed: which trials are held out.
    """
    held = with_object(recording)
    fitted, held_out = held_out_split(held, seed=seed)
    replay = HandReplay(held, nominal_model(held, model), step)
    try:
        yield GraspTrials(
            joints=tuple(held.joints),
            fitted=[ContactTrial(replay, trial) for trial in fitted.trials],
            held_out=[ContactTrial(replay, trial) for trial in held_out.trials],
            start=contact_of(model),
            noise_floor=float(np.hypot(np.sqrt(np.mean(sensor_noise(held) ** 2)), SIGMA)),
        )
    finally:
        replay.close()
