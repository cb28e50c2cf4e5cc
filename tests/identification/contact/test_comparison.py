"""A grasp beside its simulation: what the page and comparison.json are made from."""

from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.identification.contact.comparison import compare_contact
from tactile_cube.measurement.comparing.comparison import comparison_json
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tests.measurement.replay.test_hand_replay import source


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
