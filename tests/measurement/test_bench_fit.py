"""Each bench test gives back what was put into the simulated rig, within its stated interval."""

from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.measurement.bench_fit import BenchEstimates, bench_estimates
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


@pytest.fixture(scope="module")
def found(recording: Recording) -> BenchEstimates:
    return bench_estimates(recording)


def test_bench_tests_survive_writing_and_are_told_from_free_motion(recording: Recording) -> None:
    kinds = [trial.kind for trial in recording.trials]
    assert (kinds.count("known_force"), kinds.count("clamped"), kinds.count("touch")) == (12, 3, 6)
    assert {trial.kind for trial in recording.trials if not trial.is_bench} == {"holds"}


@pytest.mark.parametrize("joint", ["a", "b"])
def test_known_forces_show_kp(found: BenchEstimates, joint: str) -> None:
    kp = found.values["kp"][joint]
    assert kp.low <= KP <= kp.high
    assert kp.value == pytest.approx(KP, rel=0.1)


@pytest.mark.parametrize("joint", ["a", "b"])
def test_clamped_links_show_the_stiffness_of_the_drive(found: BenchEstimates, joint: str) -> None:
    stiffness = found.values["stiffness"][joint]
    assert stiffness.value == pytest.approx(STIFFNESS, rel=0.02)
    assert 0 < stiffness.high - stiffness.low < 2.0


@pytest.mark.parametrize("index", [0, 1])
def test_touches_span_the_joint_offsets(found: BenchEstimates, index: int) -> None:
    rng = np.random.default_rng(1)
    rng.uniform(size=6)  # the source draws three constants of two joints before the offsets
    offsets = rng.uniform(-0.03, 0.03, (3, 2))[:, index]
    estimate = found.offsets["ab"[index]]
    assert estimate.low == pytest.approx(offsets.min(), abs=2e-3)
    assert estimate.high == pytest.approx(offsets.max(), abs=2e-3)


def test_the_estimates_go_into_a_model_file(found: BenchEstimates) -> None:
    model = found.into(ModelFile(joints=["a", "b"], values={"kd": {"a": 0.2}}))  # type: ignore[dict-item]
    assert set(model.values) == {"kd", "kp", "stiffness"}
    assert set(model.offsets) == {"a", "b"}


def test_without_bench_tests_nothing_is_estimated(recording: Recording) -> None:
    assert (
        bench_estimates(recording.with_trials([one for one in recording.trials if not one.is_bench]))
        == BenchEstimates()
    )


def test_the_model_file_with_bench_values_is_valid(found: BenchEstimates, tmp_path: Path) -> None:
    model = found.into(ModelFile(joints=["a", "b"]))
    assert ModelFile.model_validate(model.model_dump()) == model
