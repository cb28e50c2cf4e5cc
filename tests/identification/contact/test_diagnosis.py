"""What a contact lacks is named by the criteria of every other diagnosis."""

from pathlib import Path

import numpy as np
import pytest

from tactile_cube.api.diagnosis import DiagnosisResult
from tactile_cube.api.job import called_job
from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile, Provenance
from tactile_cube.errors import InputError
from tactile_cube.identification.contact.grasps import compare_contact
from tactile_cube.identification.contact.identification import ContactDiagnosis, diagnosed, stepped, with_contact
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.measurement.comparing.comparison import comparison_json
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.simulation.contact_effects import ContactEffect, contact_catalogue
from tests.identification.easy_grasps import JOINTS, Values, easy_grasps
from tests.measurement.replay.test_hand_replay import source
from tests.measurement.small_rig import write

NAMES = [f"j{k}" for k in range(JOINTS)]
LATERAL: Values = {"lateral_friction": {"coefficient": 0.5}}
TRUTHS: list[Values] = [
    LATERAL,
    {"spinning_friction": {"radius": 0.012}},
    {"tip_compliance": {"compliance": 1e-3}},
    {"object_mass": {"excess": 0.06}},
    {"object_com": {"x": 4e-3, "y": -8e-3, "z": 6e-3}},
    {"object_size": {"excess": 4e-3}},
]


def diagnosis(truth: Values) -> ContactDiagnosis:
    return diagnosed(easy_grasps(truth), NAMES, STANDARD, lambda line: None)


@pytest.mark.parametrize("truth", [{}, *TRUTHS, LATERAL | TRUTHS[1]], ids=lambda truth: "+".join(truth) or "nothing")
def test_the_effects_that_are_missing_are_found_and_no_others_within_their_intervals(truth: Values) -> None:
    found = diagnosis(truth)
    assert {one.effect for one in found.effects()} == truth.keys()
    assert found.verdict == ("missing_effect" if truth else "adequate")
    for one in found.effects():
        for key, estimate in one.parameters.items():
            assert estimate.low <= truth[one.effect][key] <= estimate.high
            assert estimate.low < estimate.high


@pytest.mark.parametrize("strict", [Criteria(least_gain=0.9), Criteria(significant=1e-30)], ids=["price", "chance"])
def test_the_criteria_reach_contact(strict: Criteria) -> None:
    assert diagnosed(easy_grasps(LATERAL), NAMES, strict, lambda line: None).verdict == "unknown_effect"


@pytest.mark.parametrize("effect", [*contact_catalogue().values()])
def test_a_step_from_the_best_start_comes_near_the_truth(effect: type[ContactEffect]) -> None:
    truth = next(one for one in TRUTHS if effect.name in one)
    grasps = easy_grasps(truth)
    _, fitted = stepped(grasps.fitted, grasps.start, effect)
    before = grasps.fitted.judged(grasps.start).costs.sum() - grasps.fitted.judged(grasps.start).samples.sum()
    after = grasps.fitted.judged(fitted.model).costs.sum() - grasps.fitted.judged(fitted.model).samples.sum()
    assert after < 0.5 * before


def test_the_answer_has_the_keys_of_diagnosis_json() -> None:
    result = diagnosis(LATERAL).as_json()
    assert result["verdict"] == "missing_effect"
    (entry,) = result["effects"]
    assert (entry["name"], entry["joints"], entry["rivals"]) == ("lateral_friction", ["object"], [])
    assert entry["heldout_gain"] > 0.1
    assert entry["p_value"] < STANDARD.significant
    assert set(entry["parameters"]["coefficient"]) == {"value", "low", "high", "unit"}
    assert set(result["error"]) == {"nominal", "refitted", "with_effects", "noise_floor"}
    assert result["ranking"][0]["effects"] == "lateral_friction"


@pytest.mark.parametrize(
    ("drive", "truth", "verdict"),
    [
        ("adequate", {}, "adequate"),
        ("adequate", LATERAL, "missing_effect"),
        ("missing_effect", {}, "missing_effect"),
        ("unknown_effect", LATERAL, "unknown_effect"),
        ("partly_explained", LATERAL, "partly_explained"),
    ],
)
def test_the_verdicts_on_drivetrain_and_contact_become_one(drive: str, truth: Values, verdict: str) -> None:
    result = {"verdict": drive, "effects": [], "partial_effects": []}
    assert with_contact(result, diagnosis(truth))["verdict"] == verdict


def test_the_model_file_tells_which_trials_judged() -> None:
    model = ModelFile(joints=["a"], provenance=Provenance(trials=["hold_0", "hold_3"]))
    made = diagnosis(LATERAL).into(model, alone=True)
    assert (made.provenance.trials, made.provenance.held_out) == (["hold_0"], ["hold_3", "twist_3"])


def test_an_adequate_contact_adds_nothing_to_the_model() -> None:
    assert diagnosis({}).into(ModelFile(joints=["a"]), alone=False).effects == []


def test_a_report_is_written_beside_model_and_answer(tmp_path: Path) -> None:
    recording, found = read_recording(write(tmp_path / "r")), diagnosis(LATERAL)
    model = found.into(ModelFile(joints=list(recording.joints)), alone=True)
    data = found.as_json() | {"known_effects": [], "seconds": 1.0}
    job = called_job("diagnose", {"recording": tmp_path / "r"})
    DiagnosisResult(recording, None, None, found, model, data, job).write(tmp_path / "out")
    assert {one.name for one in (tmp_path / "out").iterdir()} == {"model.yaml", "diagnosis.json", "report.html"}
    page = (tmp_path / "out" / "report.html").read_text()
    assert "effects=[lateral_friction]" in page
    assert "takes" in page


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
