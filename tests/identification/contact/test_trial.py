"""What nobody knows of a grasp is fitted for each value of the contact by itself, whatever was asked before."""

import numpy as np
import pytest

from tactile_cube.identification.contact.trial import FARTHEST, ContactTrial
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.replay.hand_replay import ContactModel, HandReplay
from tactile_cube.measurement.replay.nominal import nominal_model
from tests.measurement.replay.test_hand_replay import source

STATED, SLIPPERY = ContactModel({}), ContactModel({"spinning_friction": {"radius": 0.01}})
OFFSET = 0.015  # [rad] largest


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    made = source(kinds=["twist"], levers=[0.06], hidden=[], offset=OFFSET, placing=1e-3).recordings(seed=4)[""]
    folder = tmp_path_factory.mktemp("twist") / "r"
    write_recording(folder, made)
    return read_recording(folder)


@pytest.fixture(scope="module")
def replay(recording: Recording) -> HandReplay:
    return HandReplay(recording, nominal_model(recording))


@pytest.fixture(scope="module")
def trial(recording: Recording, replay: HandReplay) -> ContactTrial:
    return ContactTrial(replay, recording.trials[0])


def test_offsets_and_place_take_most_of_the_error_away(replay: HandReplay, trial: ContactTrial) -> None:
    plain = trial.trial.position - replay.simulate(trial.trial, STATED, np.zeros(12)).position
    assert np.sqrt(np.mean(trial.residual(STATED) ** 2)) < 0.6 * np.sqrt(np.mean(plain**2))
    assert np.abs(trial.nuisance(STATED)[-3:]).max() <= FARTHEST


def test_fingers_that_take_no_part_keep_their_offsets(trial: ContactTrial) -> None:
    offsets = trial.nuisance(STATED)[:12].reshape(4, 3)
    assert not offsets[[0, 2]].any()
    assert offsets[[1, 3]].any()


def test_the_cost_of_a_value_does_not_depend_on_what_was_tried_between(replay: HandReplay, trial: ContactTrial) -> None:
    other = ContactTrial(replay, trial.trial)
    other.cost(STATED)
    for radius in (0.003, 0.03):
        other.cost(ContactModel({"spinning_friction": {"radius": radius}}))
    trial.cost(STATED)
    assert other.cost(SLIPPERY) == trial.cost(SLIPPERY)


def test_a_neutral_value_is_simulated_once(trial: ContactTrial) -> None:
    stated = trial.residual(STATED)
    assert trial.residual(ContactModel({"object_mass": {"excess": 0.0}})) is stated
