"""Bench tests as trials, and what touches show of the simulated rig's joint offsets."""

import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.measurement.bench import touch_offsets, without_touches
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.simulated_rig import SimulatedRig
from tests.measurement.small_rig import URDF

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
