"""Bench tests as trials, and what touches show of the simulated rig's joint offsets."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.errors import InputError
from tactile_cube.measurement.bench import KINDS, excitation, safe_range, touch_offsets, without_touches
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import RigJoint
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.simulated_rig import SimulatedRig
from tactile_cube.measurement.split import held_out_split, with_test_part
from tests.measurement.small_rig import URDF, setting, write

KP, STIFFNESS = 3.0, 25.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    folder = tmp_path_factory.mktemp("bench")
    (folder / "two.urdf").write_text(URDF)
    source = SimulatedRig(
        urdf=str(folder / "two.urdf"),
        controller={"kp": KP, "kd": 0.2, "torque_limit": 1.0},
        nominal={"stiffness": STIFFNESS, "static_friction": 0.01, "reflected_inertia": 0.003},
        kinds=["known_force", "clamped", "touch", "holds"],
        duration=2.0,
        rate=250.0,
        step=0.002,
        offset=0.03,
        validation=False,
    )
    write_recording(folder / "r", source.recordings(seed=1)[""])
    return read_recording(folder / "r")


def test_bench_tests_survive_writing_and_are_told_from_free_motion(recording: Recording) -> None:
    kinds = [trial.kind for trial in recording.trials]
    assert (kinds.count("known_force"), kinds.count("clamped"), kinds.count("touch")) == (12, 3, 6)
    assert {trial.kind for trial in recording.trials if not trial.is_bench} == {"holds"}


@pytest.mark.parametrize("index", [0, 1])
def test_touches_span_the_joint_offsets(recording: Recording, index: int) -> None:
    rng = np.random.default_rng(1)
    rng.uniform(size=6)  # the source draws three constants of two joints before the offsets
    offsets = rng.uniform(-0.03, 0.03, (3, 2))[:, index]
    estimate = touch_offsets(recording, ModelFile(joints=["a", "b"]))["ab"[index]]
    assert estimate.low == pytest.approx(offsets.min(), abs=2e-3)
    assert estimate.high == pytest.approx(offsets.max(), abs=2e-3)


def test_a_softer_drive_of_the_model_explains_more_of_what_a_touch_shows(recording: Recording) -> None:
    soft = ModelFile.model_validate({"joints": ["a", "b"], "values": {"stiffness": {"a": 0.5 * STIFFNESS}}})
    stated, other = (touch_offsets(recording, model) for model in (ModelFile(joints=["a", "b"]), soft))
    assert other["a"].value < stated["a"].value - 5e-3
    assert other["b"] == stated["b"]


def test_without_touches_no_offset_is_known(recording: Recording) -> None:
    assert touch_offsets(without_touches(recording), ModelFile(joints=["a", "b"])) == {}


@pytest.mark.parametrize("kind", list(KINDS))
def test_commands_stay_inside_and_use_the_range(kind: str) -> None:
    low, high = np.array([-0.2, 0.1]), np.array([0.3, 1.0])
    command = excitation(kind, low, high, 10.0, 200.0, np.random.default_rng(0))
    assert command.shape == (2000, 2)
    assert (command >= low - 1e-9).all()
    assert (command <= high + 1e-9).all()
    assert (np.ptp(command, axis=0) > 0.3 * (high - low)).all()


@pytest.mark.parametrize(("kind", "longest", "moving"), [("holds", 76, 0.3), ("steps", 11, 0.05)])
def test_holds_and_steps_rest_between_quick_moves(kind: str, longest: int, moving: float) -> None:
    command = excitation(kind, np.zeros(1), np.ones(1), 20.0, 500.0, np.random.default_rng(0))[:, 0]
    moves = np.abs(np.diff(command)) > 1e-12
    lengths = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], moves, [0]]))))[::2]
    assert len(lengths) >= 15
    assert lengths.max() <= longest
    assert np.mean(moves) < moving


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(InputError, match="'chirp' is no excitation"):
        excitation("chirp", np.zeros(1), np.ones(1), 1.0, 100.0, np.random.default_rng(0))


def test_a_joint_without_limits_gets_a_range() -> None:
    assert safe_range(RigJoint("wheel", -np.inf, np.inf, None), 0.5) == (-0.5, 0.5)
    assert safe_range(RigJoint("a", -0.2, 1.0, None), 0.5) == pytest.approx((0.1, 0.7))


def test_whole_initialisations_are_held_out(tmp_path: Path) -> None:
    fit, held = held_out_split(read_recording(write(tmp_path)))
    assert {t.initialisation for t in fit.trials}.isdisjoint(t.initialisation for t in held.trials)
    assert len(fit.trials) == len(held.trials) == 1


def test_without_initialisations_every_kind_stays_in_the_fit(tmp_path: Path) -> None:
    fit, held = held_out_split(read_recording(write(tmp_path, setting({"trials.1.initialisation": 0}))))
    assert {t.kind for t in fit.trials} == {"sines"}
    assert len(held.trials) == 1


def test_where_nothing_was_repeated_some_kinds_are_held_out(tmp_path: Path) -> None:
    trials = [{"file": "first.parquet", "initialisation": 0, "kind": f"log{k}"} for k in range(6)]
    fit, held = held_out_split(read_recording(write(tmp_path, setting({"trials": trials}))))
    assert (len(fit.trials), len(held.trials)) == (4, 2)
    assert {t.kind for t in fit.trials}.isdisjoint(t.kind for t in held.trials)


def test_a_single_trial_cannot_be_split(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"1 trial in all.*source\.length=SECONDS"):
        held_out_split(read_recording(write(tmp_path, setting({"trials": [{"file": "first.parquet"}]}))))


def twelve(tmp_path: Path, initialisations: int) -> Recording:
    names = [{"initialisation": k % initialisations, "kind": f"log{k % 4}"} for k in range(12)]
    trials = [{"file": "first.parquet"} | one for one in names]
    read = read_recording(write(tmp_path, setting({"trials": trials})))
    return read.with_trials([replace(trial, name=f"t{k}") for k, trial in enumerate(read.trials)])


@pytest.mark.parametrize("initialisations", [1, 3])
def test_the_trials_that_test_are_neither_fitted_nor_chosen_by(tmp_path: Path, initialisations: int) -> None:
    whole = twelve(tmp_path, initialisations)
    fit, held = held_out_split(whole)
    less, tested = with_test_part(fit, 12)
    assert tested is not None
    assert len(tested.trials) == 2
    parts = [{trial.name for trial in part.trials} for part in (less, held, tested)]
    assert set().union(*parts) == {trial.name for trial in whole.trials}
    assert sum(len(part) for part in parts) == 12
    assert {t.kind for t in less.trials} == {t.kind for t in fit.trials}, "each kind stays in the fit"


def test_few_trials_are_all_needed_by_the_fit(tmp_path: Path) -> None:
    fit, _ = held_out_split(read_recording(write(tmp_path)))
    assert with_test_part(fit, 2) == (fit, None)
