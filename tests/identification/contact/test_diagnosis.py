from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile, Provenance
from tactile_cube.errors import InputError
from tactile_cube.identification.contact.diagnosis import ContactDiagnosis, ContactSearch, Tried, with_contact
from tactile_cube.identification.contact.fit import ContactFit
from tactile_cube.identification.contact.trial import compare_contact
from tactile_cube.measurement.comparing.comparison import comparison_json
from tactile_cube.measurement.comparing.error import ErrorSummary
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.replay.hand_replay import ContactModel
from tactile_cube.simulation.contact_effects import ObjectSize
from tests.identification.easy_contact import EasyTrial, GrippedTrial, friction
from tests.measurement.replay.test_hand_replay import source


def search(lateral: float = 0.9, spinning: float = 0.1) -> ContactSearch:
    trials = [friction(kind, k, lateral, spinning) for k in range(3) for kind in ("hold", "twist")]
    made = ContactSearch(trials[:4], trials[4:], lambda line: None)  # type: ignore[arg-type]
    made.run(ContactModel({}))
    return made


@pytest.mark.parametrize(
    ("truth", "names"),
    [
        ({}, []),
        ({"lateral": 0.5}, ["lateral_friction"]),
        ({"spinning": 0.02}, ["spinning_friction"]),
        ({"lateral": 0.5, "spinning": 0.02}, ["spinning_friction", "lateral_friction"]),
    ],
)
def test_the_effects_that_are_missing_are_found_and_no_others(truth: dict[str, float], names: list[str]) -> None:
    found = search(**truth)
    assert [one.effect.name for one in found.found] == names
    assert found.verdict(1e-3) == ("missing_effect" if names else "adequate")


@pytest.mark.parametrize(("size", "names"), [(0.0, []), (0.006, ["object_size"])])
def test_a_size_is_found_by_the_offsets_that_grips_need(size: float, names: list[str]) -> None:
    trials = [GrippedTrial("hold", k, {("object_size", "excess"): size}, {}) for k in range(4)]
    found = ContactSearch(trials[:3], trials[3:], lambda line: None)  # type: ignore[arg-type]
    found.run(ContactModel({}))
    assert [one.effect.name for one in found.found] == names
    assert [one.gain_of for one in found.found] == ["offsets"] * len(names)  # and not of the error, which stays
    assert found.rivals == []


@pytest.mark.parametrize(("sizes", "names"), [((0.005, 0.004, 0.006), ["object_size"]), ((0.005, -0.005, 0.003), [])])
def test_only_what_the_initialisations_agree_on_is_kept(sizes: tuple[float, ...], names: list[str]) -> None:
    trials = [GrippedTrial("hold", k, {("object_size", "excess"): size}, {}) for k, size in enumerate(sizes)]
    said: list[str] = []
    made = ContactSearch(trials, trials, said.append)  # type: ignore[arg-type]
    made.found = [Tried(ObjectSize, ContactModel({}), 1e-3, 0.4, 1e-9, "offsets")]
    fit = made.prove(ContactModel({}))
    assert [one.effect.name for one in made.found] == names
    assert [effect for effect, _ in fit.estimates] == names
    assert ("object_size: the initialisations do not agree that there is any" in said) is not bool(names)


def test_what_no_effect_explains_is_unknown() -> None:
    found = search()
    assert found.verdict(0.0025) == "unknown_effect"


def test_an_effect_that_explains_as_much_is_a_rival() -> None:
    key, other = ("lateral_friction", "coefficient"), ("tip_compliance", "compliance")

    class Confused(EasyTrial):
        def residual(self, contact: ContactModel) -> np.ndarray:
            soft = contact.values.get(other[0], {}).get(other[1], 0.0)
            rough = contact.values.get(key[0], {}).get(key[1], 0.9)
            off = min(abs(np.log(rough / 0.5)), abs(soft / 1e-3 - 1))
            return 1e-3 * self.noise + 1e-2 * off

    trials = [Confused("hold", k, {}, {}) for k in range(4)]
    found = ContactSearch(trials[:3], trials[3:], lambda line: None)  # type: ignore[arg-type]
    found.run(ContactModel({}))
    assert found.verdict(1e-3) == "ambiguous"
    named = {found.found[-1].effect.name, *(one.effect.name for one in found.rivals)}
    assert named == {"lateral_friction", "tip_compliance"}


def diagnosis(lateral: float) -> ContactDiagnosis:
    made = search(lateral)
    stages = {key: ErrorSummary(1e-3, {"a": 1e-3}) for key in ("nominal", "with_effects")}
    return ContactDiagnosis(ContactFit(ContactModel({}), {}, {}), stages, 2e-4, ["hold_3"], made)


def test_the_answer_has_the_keys_of_diagnosis_json() -> None:
    result = diagnosis(0.5).as_json()
    assert result["verdict"] == "missing_effect"
    (entry,) = result["effects"]
    assert (entry["name"], entry["rivals"]) == ("lateral_friction", [])
    assert entry["heldout_gain"] > 0.5
    assert entry["p_value"] < 0.05
    assert set(entry["parameters"]["coefficient"]) == {"value", "low", "high", "unit"}
    assert set(result["error"]) == {"nominal", "refitted", "with_effects", "noise_floor"}


@pytest.mark.parametrize(
    ("drive", "lateral", "verdict"),
    [
        ("adequate", 0.9, "adequate"),
        ("adequate", 0.5, "missing_effect"),
        ("missing_effect", 0.9, "missing_effect"),
        ("unknown_effect", 0.5, "unknown_effect"),
        ("partly_explained", 0.9, "partly_explained"),
        ("partly_explained", 0.5, "partly_explained"),
    ],
)
def test_the_verdicts_on_drivetrain_and_contact_become_one(drive: str, lateral: float, verdict: str) -> None:
    result = {"verdict": drive, "effects": [], "partial_effects": []}
    assert with_contact(result, diagnosis(lateral))["verdict"] == verdict


def test_the_model_file_tells_which_trials_judged() -> None:
    model = ModelFile(joints=["a"], provenance=Provenance(trials=["hold_0", "hold_3"]))
    made = diagnosis(0.5).into(model, alone=True)
    assert (made.provenance.trials, made.provenance.held_out) == (["hold_0"], ["hold_3"])


def test_an_adequate_contact_adds_nothing_to_the_model() -> None:
    model = ModelFile(joints=["a"])
    assert diagnosis(0.9).into(model, alone=False).effects == []


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    folder: Path = tmp_path_factory.mktemp("twist") / "r"
    made = source(kinds=["twist"], levers=[0.06], hidden=["spinning_friction: radius=0.01"]).recordings(seed=4)[""]
    write_recording(folder, made)
    return read_recording(folder)


def test_a_model_with_the_hidden_effect_follows_the_grasp_better(recording: Recording) -> None:
    truth = {"radius": Estimate(value=0.01, low=0.01, high=0.01, unit="m")}
    model = ModelFile(
        joints=list(recording.joints), effects=[EffectEstimate(effect="spinning_friction", parameters=truth)]
    )
    said: list[str] = []
    stated, true = (compare_contact(recording, one, say=said.append) for one in (None, model))
    assert true.errors.overall < 0.6 * stated.errors.overall
    assert said == ["twist_0_0 simulated, 1 of 1"] * 2
    assert comparison_json(true)["noise_floor"]["source"] == "guess"
    assert np.isfinite(true.ratio)


def test_a_model_of_another_rig_is_refused(recording: Recording) -> None:
    with pytest.raises(InputError, match=r"joints \['a'\] are not those of the recording"):
        compare_contact(recording, ModelFile(joints=["a"]))
