"""Friction that was put into a simulated hand comes back from a recording of it, within the stated interval."""

import json
from pathlib import Path
from typing import Any

import pytest
import yaml

from tactile_cube.composition import CONFIG
from tactile_cube.drivetrain.model_file import Estimate
from tactile_cube.errors import InputError
from tactile_cube.identification.contact.identification import ContactIdentification, contact_effects, identify_contact
from tactile_cube.identification.model_files import stated_model
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.simulated_grasp import SimulatedGrasp
from tactile_cube.randomization import Randomization, Uniform, identified
from tactile_cube.simulation import EpisodeConstants
from tests.measurement import small_rig

LATERAL, SPINNING = 0.6, 0.03
pytestmark = pytest.mark.timeout(300)  # half a minute of computing, on a machine that may be busy


def simulated(folder: Path, **changes: Any) -> Path:
    """A recording as `record source=grasp` makes it."""
    settings = yaml.safe_load((CONFIG / "source" / "grasp.yaml").read_text())
    settings = {key: value for key, value in settings.items() if key != "_target_"} | changes
    write_recording(folder, SimulatedGrasp(**settings).recordings(seed=2)[""])
    return folder


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    hidden = [f"lateral_friction: coefficient={LATERAL}", f"spinning_friction: radius={SPINNING}"]
    folder = tmp_path_factory.mktemp("grasp") / "r"
    changes = {"weights": [0.25], "levers": [0.06], "initialisations": 3, "validation": False, "step": 0.002}
    return read_recording(simulated(folder, hidden=hidden, **changes))


@pytest.fixture(scope="module")
def found(recording: Recording) -> ContactIdentification:
    effects = contact_effects(["lateral_friction", "spinning_friction"], recording)
    return identify_contact(recording, effects, say=lambda line: None)


def estimate_of(found: ContactIdentification, effect: str, parameter: str) -> Estimate:
    (one,) = (one for one in found.effects() if one.effect == effect)
    return one.parameters[parameter]


def test_the_recording_tells_of_the_load_and_not_of_the_friction(recording: Recording) -> None:
    assert recording.warnings == ()
    assert {trial.kind for trial in recording.trials} == {"hold", "twist"}
    assert [trial.load.mass for trial in recording.trials if trial.load] == [0.25, 0.1] * 3
    assert [trial.load.com[1] for trial in recording.trials if trial.load] == [0.0, 0.06] * 3
    assert "friction: " not in (recording.folder / "recording.yaml").read_text().replace("static_friction: ", "")


@pytest.mark.parametrize(
    ("effect", "parameter", "truth", "factor"),
    [("lateral_friction", "coefficient", LATERAL, 1.2), ("spinning_friction", "radius", SPINNING, 1.45)],
)
def test_friction_comes_back_within_its_interval(found, effect, parameter, truth, factor) -> None:
    estimate = estimate_of(found, effect, parameter)
    assert estimate.low <= truth <= estimate.high
    assert truth / factor < estimate.value < truth * factor
    assert estimate.high / estimate.low < factor**4


def test_the_error_falls_on_initialisations_that_the_fit_never_saw(found: ContactIdentification) -> None:
    assert found.held_out
    assert found.stages["with_effects"].overall < 0.65 * found.stages["nominal"].overall


def test_the_model_file_names_values_intervals_and_units(found: ContactIdentification, recording: Recording) -> None:
    model = found.into(stated_model(recording, "identify", 0), alone=True)
    assert [one.effect for one in model.effects] == ["lateral_friction", "spinning_friction"]
    assert [e.unit for one in model.effects for e in one.parameters.values()] == ["1", "m"]
    assert all(e.low < e.value < e.high for one in model.effects for e in one.parameters.values())
    assert model.errors.with_effects == found.stages["with_effects"].overall
    assert json.loads(json.dumps(found.as_json()))["silent"] == []
    assert set(model.provenance.held_out) == set(found.held_out)
    assert not set(model.provenance.trials) & set(found.held_out)


def test_the_training_world_takes_values_and_intervals(found: ContactIdentification, recording: Recording) -> None:
    model = found.into(stated_model(recording, "identify", 0), alone=True)
    constants, randomization, effects = identified(model, EpisodeConstants(), Randomization(), recording.joints)
    estimate = estimate_of(found, "lateral_friction", "coefficient")
    assert (constants.tip_friction, effects) == (estimate.value, [])
    assert randomization.values["tip_friction"] == Uniform(estimate.low, estimate.high)


def test_a_contact_effect_without_an_object_is_refused(tmp_path: Path) -> None:
    recording = read_recording(small_rig.write(tmp_path / "r"))
    with pytest.raises(InputError, match=r"'lateral_friction' shows only where the hand holds .* key 'object'.*record"):
        contact_effects(["lateral_friction"], recording)


def test_a_contact_effect_at_a_joint_is_refused(recording: Recording) -> None:
    with pytest.raises(InputError, match="'object_mass@ring_q1': object_mass belongs to fingertips and object"):
        contact_effects(["object_mass@ring_q1"], recording)
    assert contact_effects(["backlash@ring_q1"], recording) == []


def test_a_hand_of_other_joints_is_refused(tmp_path: Path) -> None:
    def hold(data: dict[str, Any]) -> None:
        data["object"] = {"size": 0.08, "mass": 0.1}
        for trial in data["trials"]:
            trial["object"] = {"position": [0.0, 0.0, 0.0]}

    recording = read_recording(small_rig.write(tmp_path / "r", hold))
    effects = contact_effects(["lateral_friction"], recording)
    with pytest.raises(InputError, match=r"recording.yaml: key 'joints': received .*'a', 'b'.*whole hand"):
        identify_contact(recording, effects, say=lambda line: None)


def _no_size(data: dict[str, Any]) -> None:
    data["object"] = {"mass": 0.1}


def _no_object(data: dict[str, Any]) -> None:
    data["trials"][1]["object"] = {"position": [0.0, 0.0, 0.0]}


def _weightless(data: dict[str, Any]) -> None:
    data["object"] = {"size": 0.08, "mass": 0.0}


def _flat(data: dict[str, Any]) -> None:
    data["object"] = {"size": [0.08, 0.08], "mass": 0.1}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_no_size, r"recording.yaml: key 'object\.size': Field required"),
        (_no_object, "recording.yaml: .*trials.1.object.*add a key 'object'.*size .m. and mass .kg."),
        (_weightless, "recording.yaml: key 'object.mass'.*greater than 0, received 0.0"),
        (_flat, "recording.yaml: key 'object.size"),
    ],
)
def test_an_object_that_is_not_described_is_refused(tmp_path, change, message) -> None:
    with pytest.raises(InputError, match=message):
        read_recording(small_rig.write(tmp_path / "r", change))
