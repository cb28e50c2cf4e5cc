"""What is known beforehand of a model's numbers."""

from pathlib import Path

import pytest

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.identification.search.candidates import model_unknowns
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.replay.model import nominal_model
from tests.measurement.small_rig import write


def test_what_an_earlier_model_found_is_expected_where_it_was_found(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    joint = recording.joints[0]
    friction = Estimate(value=0.03, low=0.02, high=0.04, unit="N m")
    found = EffectEstimate(effect=f"coulomb_friction@{joint}", parameters={"friction": friction})
    known = ModelFile(joints=list(recording.joints), effects=[found])
    model = nominal_model(recording, known)
    (unknown,) = model_unknowns(model)
    assert (unknown.of(model), unknown.centre) == (0.03, 0.03)
    assert unknown.spread == pytest.approx(0.01), "a standard deviation is half of a 95 % interval: twice as far"


def test_of_an_effect_that_nobody_knows_nothing_is_expected(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    assert nominal_model(recording).terms == ()
    exact = Estimate(value=0.03, low=0.03, high=0.03, unit="N m")
    found = EffectEstimate(effect=f"coulomb_friction@{recording.joints[0]}", parameters={"friction": exact})
    known = ModelFile(joints=list(recording.joints), effects=[found])
    assert model_unknowns(nominal_model(recording, known)) == (), "a number without an interval stays as it is"
