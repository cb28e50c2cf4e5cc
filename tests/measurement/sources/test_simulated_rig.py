from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import parse_effect
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.simulated_rig import SimulatedRig
from tests.measurement.small_rig import URDF

SETTINGS = {
    "controller": {"kp": 3.0, "kd": 0.2, "torque_limit": 1.0},
    "nominal": {"stiffness": 25.0, "static_friction": 0.01, "reflected_inertia": 0.003},
    "duration": 2.0,
    "step": 0.002,
    "rate": 250.0,
    "initialisations": 2,
}


@pytest.fixture
def urdf(tmp_path: Path) -> str:
    (tmp_path / "two.urdf").write_text(URDF)
    return str(tmp_path / "two.urdf")


def test_a_written_recording_is_read_back_without_warnings(urdf: str, tmp_path: Path) -> None:
    made = SimulatedRig(urdf=urdf, **SETTINGS).recordings(seed=0)
    assert set(made) == {"", "validation"}
    write_recording(tmp_path / "r", made[""])
    recording = read_recording(tmp_path / "r")
    assert recording.warnings == ()
    assert [t.kind for t in recording.trials] == ["ramps", "multisine", "policy", "holds"] * 2
    assert np.array_equal(recording.trials[0].command, recording.trials[4].command)
    assert recording.trials[0].torque is not None


def test_the_same_seed_writes_the_same_recording(urdf: str) -> None:
    one, two = (SimulatedRig(urdf=urdf, kinds=["ramps"], **SETTINGS).recordings(seed=3)[""] for _ in range(2))
    assert all(np.array_equal(a.position, b.position) for a, b in zip(one.tables, two.tables, strict=True))


def test_a_hidden_effect_changes_the_motion_and_not_the_description(urdf: str) -> None:
    settings = SETTINGS | {"kinds": ["multisine"], "noise": 0.0, "offset": 0.0}
    plain = SimulatedRig(urdf=urdf, **settings).recordings(seed=0)[""]
    hidden = SimulatedRig(urdf=urdf, hidden=["command_delay@a: delay=0.04"], **settings).recordings(seed=0)[""]
    assert hidden.description == plain.description
    difference = np.abs(hidden.tables[0].position - plain.tables[0].position).max(axis=0)
    assert difference[0] > 0.01


def test_positions_are_quantised_and_offsets_differ(urdf: str) -> None:
    made = SimulatedRig(urdf=urdf, kinds=["holds"], resolution=0.01, **SETTINGS).recordings(seed=0)[""]
    steps = made.tables[0].position / 0.01
    assert np.allclose(steps, np.round(steps))
    assert made.description.sensors.position_resolution == 0.01


def test_a_hidden_effect_takes_typical_values_unless_told() -> None:
    name, values = parse_effect("stribeck_friction@q3: excess=0.08")
    assert name == "stribeck_friction@q3"
    assert values["excess"] == 0.08
    assert values["velocity"] > 0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("stribeck_friction@q3: size=1", "has the parameters"),
        ("stribeck_friction@q3: excess=much", "is no number"),
        ("stribek@q3", "stribek"),
    ],
)
def test_a_wrong_hidden_effect_is_refused(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        parse_effect(text)
