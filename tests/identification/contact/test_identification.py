"""Friction that was put into a simulated hand comes back from a recording of it, within the stated interval."""

import json
from pathlib import Path
from typing import Any, NamedTuple

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

pytestmark = pytest.mark.timeout(300)  # half a minute of computing, on a machine that may be busy


class Case(NamedTuple):
    """A friction, how a grip shows it that loosens in so many seconds, and by which factor its value may be wrong."""

    effect: str
    parameter: str
    constant: str
    kind: str
    loosen: float
    truth: float
    factor: float


CASES = [
    Case("lateral_friction", "coefficient", "tip_friction", "hold", 2.0, 0.6, 1.2),
    Case("spinning_friction", "radius", "tip_spinning_friction", "twist", 6.0, 0.03, 1.45),
]


def simulated(folder: Path, **changes: Any) -> Path:
    """A recording as `record source=grasp` makes it."""
    settings = yaml.safe_load((CONFIG / "source" / "grasp.yaml").read_text())
    settings = {key: value for key, value in settings.items() if key != "_target_"} | changes
    write_recording(folder, SimulatedGrasp(**settings).recordings(seed=2)[""])
    return folder


@pytest.fixture(scope="module", params=CASES, ids=lambda case: case.effect)
def case(request: pytest.FixtureRequest) -> Case:
    """One at a time: the grip is fitted anew for each value of each friction that is wrong, so two cost far more."""
    return request.param


@pytest.fixture(scope="module")
def recording(case: Case, tmp_path_factory: pytest.TempPathFactory) -> Recording:
    hidden = [f"{case.effect}: {case.parameter}={case.truth}"]
    changes = {"weights": [0.25], "levers": [0.06], "initialisations": 3, "loosen": case.loosen}
    folder = tmp_path_factory.mktemp("grasp") / "r"
    return read_recording(simulated(folder, kinds=[case.kind], hidden=hidden, validation=False, step=0.002, **changes))


@pytest.fixture(scope="module")
def found(case: Case, recording: Recording) -> ContactIdentification:
    return identify_contact(recording, contact_effects([case.effect], recording), say=lambda line: None)


def estimate_of(found: ContactIdentification, case: Case) -> Estimate:
    (one,) = found.effects()
    assert one.effect == case.effect
    return one.parameters[case.parameter]


def test_the_recording_tells_of_the_load_and_not_of_the_friction(case: Case, recording: Recording) -> None:
    assert recording.warnings == ()
    assert {trial.kind for trial in recording.trials} == {case.kind}
    mass, lever = {"hold": (0.25, 0.0), "twist": (0.1, 0.06)}[case.kind]
    assert [(trial.load.mass, trial.load.com[1]) for trial in recording.trials if trial.load] == [(mass, lever)] * 3
    assert "friction: " not in (recording.folder / "recording.yaml").read_text().replace("static_friction: ", "")


def test_friction_comes_back_within_its_interval(case: Case, found: ContactIdentification) -> None:
    estimate = estimate_of(found, case)
    assert estimate.low <= case.truth <= estimate.high
    assert case.truth / case.factor < estimate.value < case.truth * case.factor
    assert estimate.high / estimate.low < case.factor**4


def test_the_error_falls_on_initialisations_that_the_fit_never_saw(found: ContactIdentification) -> None:
    assert found.held_out
    assert found.stages["with_effects"].overall < 0.65 * found.stages["nominal"].overall


def test_the_model_file_names_values_intervals_and_units(case, found: ContactIdentification, recording) -> None:
    model = found.into(stated_model(recording, "identify", 0), alone=True)
    assert [one.effect for one in model.effects] == [case.effect]
    assert estimate_of(found, case).unit == {"coefficient": "1", "radius": "m"}[case.parameter]
    assert all(e.low < e.value < e.high for one in model.effects for e in one.parameters.values())
    assert model.errors.with_effects == found.stages["with_effects"].overall
    assert json.loads(json.dumps(found.as_json()))["silent"] == []
    assert set(model.provenance.held_out) == set(found.held_out)
    assert not set(model.provenance.trials) & set(found.held_out)


def test_the_training_world_takes_values_and_intervals(case, found: ContactIdentification, recording) -> None:
    model = found.into(stated_model(recording, "identify", 0), alone=True)
    constants, randomization, effects = identified(model, EpisodeConstants(), Randomization(), recording.joints)
    estimate = estimate_of(found, case)
    assert (getattr(constants, case.constant), effects) == (estimate.value, [])
    assert randomization.values[case.constant] == Uniform(estimate.low, estimate.high)


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
