"""Trials with an object, simulated in the world: the truth leaves sensor noise, anything else leaves more."""

from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.measurement.bench import has_free_motion, with_object, without_touches
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.replay.hand_replay import ContactModel, HandReplay, contact_of
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.simulator import Simulator
from tactile_cube.measurement.sources.simulated_grasp import SimulatedGrasp

TRUTH = ContactModel({"lateral_friction": {"coefficient": 0.5}})
NO_OFFSET = np.zeros(12)


def source(**changes: object) -> SimulatedGrasp:
    settings: dict[str, object] = {
        "controller": {"kp": 3.69, "kd": 0.25, "torque_limit": 1.0},
        "nominal": {"stiffness": 25.0, "static_friction": 0.02, "reflected_inertia": 0.0015},
        "hidden": ["lateral_friction: coefficient=0.5"],
        "kinds": ["hold"],
        "weights": [0.25],
        "initialisations": 1,
        "true_spread": 0.0,
        "offset": 0.0,
        "placing": 0.0,
        "step": 0.002,
        "validation": False,
    }
    return SimulatedGrasp(**settings | changes)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    folder = tmp_path_factory.mktemp("hold") / "r"
    write_recording(folder, source().recordings(seed=1)[""])
    return read_recording(folder)


@pytest.fixture(scope="module")
def replay(recording: Recording) -> HandReplay:
    return HandReplay(recording, nominal_model(recording))


def error(replay: HandReplay, recording: Recording, contact: ContactModel) -> float:
    trial = recording.trials[0]
    residual = trial.position - replay.simulate(trial, contact, NO_OFFSET).position
    return float(np.sqrt(np.mean(residual**2)))


def test_the_truth_leaves_little_and_other_friction_much_more(replay: HandReplay, recording: Recording) -> None:
    true = error(replay, recording, TRUTH)
    assert true < 1e-3
    assert error(replay, recording, ContactModel({})) > 4 * true
    assert error(replay, recording, ContactModel({**TRUTH.values, "object_mass": {"excess": -0.1}})) > 2 * true


def test_the_load_slips_later_with_more_friction(replay: HandReplay, recording: Recording) -> None:
    trial = recording.trials[0]
    rough, smooth = (
        replay.simulate(trial, ContactModel({"lateral_friction": {"coefficient": mu}}), NO_OFFSET).position
        for mu in (0.9, 0.3)
    )
    assert trial.load is not None
    released = round(trial.load.released / trial.step)
    apart = np.flatnonzero(np.abs(rough - smooth)[released:].max(axis=1) > 0.03)
    assert len(apart) > 0


def test_a_simulation_is_the_same_every_time_and_may_end_early(replay: HandReplay, recording: Recording) -> None:
    trial = recording.trials[0]
    whole = replay.simulate(trial, TRUTH, NO_OFFSET)
    early = replay.simulate(trial, TRUTH, NO_OFFSET, until=0.5)
    np.testing.assert_array_equal(early.position, whole.position[: len(early.position)])
    assert len(early.position) == 50
    np.testing.assert_array_equal(replay.simulate(trial, TRUTH, NO_OFFSET).torque, whole.torque)


def test_offsets_show_in_the_sensors(replay: HandReplay, recording: Recording) -> None:
    trial = recording.trials[0]
    offset = np.full(12, 0.01)
    moved = replay.simulate(trial, TRUTH, offset, until=0.1).position
    np.testing.assert_allclose(moved[0], trial.position[0], atol=2e-3)


def test_the_same_seed_records_the_same(recording: Recording) -> None:
    again = source().recordings(seed=1)[""].tables[0]
    np.testing.assert_array_equal(again.position.astype(np.float32), recording.trials[0].position.astype(np.float32))


def test_a_recording_of_grasps_has_no_free_motion(recording: Recording) -> None:
    assert not has_free_motion(recording)
    assert len(with_object(recording).trials) == 1
    with pytest.raises(InputError, match=r"in every trial something is touched or held.*effects="):
        without_touches(recording)


def test_a_model_file_says_what_the_contact_is_like() -> None:
    half = Estimate(value=0.5, low=0.4, high=0.6, unit="1")
    effects = [
        EffectEstimate(effect="lateral_friction", parameters={"coefficient": half}),
        EffectEstimate(effect="torque_bias@a", parameters={"bias": half}),
    ]
    assert contact_of(ModelFile(joints=["a"], effects=effects)) == TRUTH
    assert contact_of(None) == ContactModel({})


def test_an_unknown_kind_of_grasp_is_refused() -> None:
    with pytest.raises(InputError, match=r"source.kinds: unknown \['pull'\]; choose from hold, twist"):
        source(kinds=["pull"]).recordings(seed=0)


def test_what_was_written_is_what_was_held(recording: Recording) -> None:
    load = recording.trials[0].load
    assert load is not None
    assert (load.mass, load.released) == (0.25, 0.9)
    np.testing.assert_array_equal(load.size, [0.08] * 3)


def test_free_motion_and_a_held_load_come_from_one_hand(tmp_path: Path) -> None:
    silent = {"noise": 0.0, "resolution": 0.0, "torque_noise": 0.0, "duration": 1.0}
    made = source(kinds=["multisine", "hold"], hidden=["viscous_friction@ring_q2"], **silent).recordings(seed=3)
    write_recording(tmp_path, made[""])
    both = read_recording(tmp_path)
    assert [(trial.kind, trial.load is not None) for trial in both.trials] == [("multisine", False), ("hold", True)]
    assert has_free_motion(both)
    (free,) = without_touches(both).trials
    ((simulated,),) = Simulator(both).free_runs([nominal_model(both)], [free])
    error = np.sqrt(np.mean((simulated.position - free.position) ** 2, axis=0))
    ring = [both.joints.index(f"ring_q{k}") for k in (1, 2, 3)]
    assert error[ring[1]] > 8e-3, "the hidden effect"
    assert np.delete(error, ring).max() < 1e-3, "the other fingers are as stated"
