"""What nobody knows of a grasp is fitted for each value of the contact by itself, whatever was asked before."""

import numpy as np
import pytest

from tactile_cube.identification.contact.grasps import ALIKE, EVERY, FARTHEST, Grasp, Grasps
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.replay.hand_replay import ContactModel, HandReplay
from tactile_cube.measurement.replay.model import Model, nominal_model
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
def grasp(recording: Recording, replay: HandReplay) -> Grasp:
    return Grasp(replay, recording.trials[0])


def test_offsets_and_place_take_most_of_the_error_away(replay: HandReplay, grasp: Grasp) -> None:
    needed, left = grasp.fitted(STATED)
    plain = grasp.trial.position - replay.simulate(grasp.trial, STATED, np.zeros(12)).position
    assert np.sqrt(np.mean(left**2)) < 0.6 * np.sqrt(np.mean(plain**2))
    assert np.abs(needed[-3:]).max() <= FARTHEST


def test_fingers_that_take_no_part_keep_their_offsets(grasp: Grasp) -> None:
    offsets = grasp.fitted(STATED)[0][:12].reshape(4, 3)
    assert not offsets[[0, 2]].any()
    assert offsets[[1, 3]].any()


def test_what_is_left_does_not_depend_on_what_was_tried_between(replay: HandReplay, grasp: Grasp) -> None:
    other = Grasp(replay, grasp.trial)
    for contact in (STATED, *(ContactModel({"spinning_friction": {"radius": r}}) for r in (0.003, 0.03))):
        other.fitted(contact)
    grasp.fitted(STATED)
    np.testing.assert_array_equal(other.fitted(SLIPPERY)[1], grasp.fitted(SLIPPERY)[1])


def test_a_neutral_value_is_simulated_once(grasp: Grasp) -> None:
    assert grasp.fitted(ContactModel({"object_mass": {"excess": 0.0}})) is grasp.fitted(STATED)


def test_a_trial_counts_as_many_numbers_as_are_independent(grasp: Grasp) -> None:
    (rows,) = {round(grasp.trial.valid[::EVERY].sum() / ALIKE, 6)}
    samples = Grasps([grasp]).judged(Model({}, (), {})).samples
    assert samples[:12] == pytest.approx(rows)
    assert samples[12:].sum() == len(grasp.free)


def test_the_offsets_of_an_initialisation_count_once_however_many_trials_it_has(grasp: Grasp) -> None:
    once, twice = (Grasps([grasp] * count).judged(Model({}, (), {})) for count in (1, 2))
    for numbers in ("samples", "costs"):
        offsets = [getattr(one, numbers).reshape(-1, 12 + 15)[:, 12:].sum() for one in (once, twice)]
        assert offsets[0] == pytest.approx(offsets[1])
