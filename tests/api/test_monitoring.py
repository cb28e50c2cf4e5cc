"""A machine that is recorded again, changed and unchanged."""

import json
from pathlib import Path

import pytest

import tactile_cube
from benchmarks.real_machines.single_joint_urdf import single_joint_urdf
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.simulated_rig import SimulatedRig


def recorded(folder: Path, name: str, seed: int, *hidden: str) -> Recording:
    """Four short trials of a pendulum with hidden effects."""
    urdf = folder / "rig.urdf"
    urdf.write_text(single_joint_urdf("rig", "j", 0.1, 0.05, limit=1.2))
    source = SimulatedRig(
        urdf=str(urdf),
        controller={"kp": 3.69, "kd": 0.25, "torque_limit": 1.0},
        nominal={"stiffness": 25.0, "static_friction": 0.02, "reflected_inertia": 0.003},
        hidden=list(hidden),
        true_spread=0.0,
        kinds=["ramps", "multisine"],
        initialisations=2,
        duration=3.0,
        validation=False,
    )
    write_recording(folder / name, source.recordings(seed)[""])
    return tactile_cube.read_recording(folder / name)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("monitor")


@pytest.fixture(scope="module")
def reference(folder: Path) -> ModelFile:
    recording = recorded(folder, "reference", 0, "viscous_friction@j: damping=0.04")
    return tactile_cube.identify(recording, ["viscous_friction@j"], say=lambda line: None).model


def test_an_unchanged_machine_raises_no_alarm(folder: Path, reference: ModelFile) -> None:
    same = recorded(folder, "same", 1, "viscous_friction@j: damping=0.04")
    seen = tactile_cube.monitor(same, reference, say=lambda line: None)
    assert not seen.alarm
    assert seen.text.startswith("nothing has changed: error 1.0")
    assert f"with the {len(seen.drifts)} numbers as they were" in seen.text


def test_more_friction_is_a_changed_number_and_play_is_something_new(folder: Path, reference: ModelFile) -> None:
    worn = recorded(folder, "worn", 2, "viscous_friction@j: damping=0.08")
    seen = tactile_cube.monitor(worn, reference, say=lambda line: None)
    assert "viscous_friction@j: damping" in [one.name for one in seen.changed]
    assert not seen.missing
    seen.write(folder / "out")
    data = json.loads((folder / "out" / "monitor.json").read_text())
    assert data["alarm"]
    assert data["numbers"]["viscous_friction@j: damping"]["changed"]
    assert tactile_cube.read_model(folder / "out" / "model.yaml").effects[0].effect == "viscous_friction@j"

    loose = recorded(folder, "loose", 3, "viscous_friction@j: damping=0.04", "backlash@j: play=0.04")
    seen = tactile_cube.monitor(loose, reference, say=lambda line: None)
    assert seen.missing
    assert "something new is missing" in seen.text


def test_what_cannot_be_compared_is_told_in_one_line(folder: Path, reference: ModelFile) -> None:
    recording = recorded(folder, "any", 4)
    with pytest.raises(InputError, match=r"errors\.over_noise is missing"):
        tactile_cube.monitor(recording, ModelFile(joints=["j"]))
    with pytest.raises(InputError, match="last=1: give at least 2 trials"):
        tactile_cube.monitor(recording, reference, last=1)
    other = reference.model_copy(update={"joints": ["k"], "values": {}, "effects": [], "offsets": {}})
    with pytest.raises(InputError, match="joints"):
        tactile_cube.monitor(recording, other)
