"""How well a model follows the trials in which the hand holds an object, and where it fails."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.contact.trial import SIGMA, ContactTrial
from tactile_cube.measurement.bench import with_object
from tactile_cube.measurement.comparing.comparison import Comparison, describe_comparison
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.hand_replay import HandReplay, contact_of
from tactile_cube.measurement.replay.nominal import nominal_model, require_same_joints
from tactile_cube.measurement.replay.simulator import Simulated


def compare_contact(
    recording: Recording, model: ModelFile | None = None, step: float = 0.002, say: Callable[[str], None] = print
) -> Comparison:
    """Simulate every trial with an object in the world that training uses.

    Each trial has the joint offsets and the place of the object that suit it.

    Args:
        recording: trials without an object are left aside.
        model: of drivetrain, fingertips and object; None: as recording.yaml states them.
        step: longest physics step [s].
        say: takes progress lines.
    """
    held = with_object(recording)
    if model is not None:
        require_same_joints(held, model)
    replay, contact = HandReplay(held, nominal_model(held, model), step), contact_of(model)
    simulated = []
    try:
        for number, trial in enumerate(held.trials, start=1):
            position = trial.position - ContactTrial(replay, trial).residual(contact)
            simulated.append(Simulated(position, np.full_like(position, np.nan)))
            say(f"{trial.name} simulated, {number} of {len(held.trials)}")
    finally:
        replay.close()
    floor = NoiseFloor(SIGMA, dict.fromkeys(held.joints, SIGMA), "contact", 0, {})
    return describe_comparison(held, model, simulated, floor, None, step)
