from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from tactile_cube.drivetrain.effects import catalogue, find_effect
from tactile_cube.drivetrain.effects.effect import FINGER
from tactile_cube.identification.search.explanation import Explanation, named_by
from tactile_cube.identification.search.findings import common_offsets, find, shared_offset
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.verdict import decide
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import NOISE, Size, simulated
from tests.identification.test_verdict import FIT, judged

SIZES = {"q1": FINGER, "q2": FINGER}
RECORDING = type("Recording", (), {"joints": ("q1", "q2")})


def base(*offsets: list[float]) -> Explanation:
    """A base model with a joint offset of each initialisation [rad]."""
    model = Model({}, (), {k: np.array(one) for k, one in enumerate(offsets)})
    fit = replace(FIT, model=model)
    return Explanation((), fit, replace(judged(1.0), model=model), 1.0, 0.0)


def test_offsets_alike_in_many_initialisations_are_the_encoders() -> None:
    start = base(*([-0.08 + 1e-4 * k, 0.01] for k in range(5)))
    found = shared_offset(start, RECORDING, list(catalogue().values()), SIZES)
    assert found is not None
    assert found.effects[0].joints == ("q1",)
    assert found.fit.model.terms[0].values["offset"] == pytest.approx(0.08, abs=1e-3)


@pytest.mark.parametrize("second", [-0.078, 0.05])
def test_two_initialisations_that_agree_are_worth_a_word_and_no_more(second: float) -> None:
    start = base([-0.08, 0.01], [second, -0.02])
    assert shared_offset(start, RECORDING, list(catalogue().values()), SIZES) is None
    assert [(one.joint, one.initialisations) for one in common_offsets(start, SIZES)] == (
        [("q1", 2)] if second < 0 else []
    )


@pytest.mark.parametrize(("scatter", "found"), [(0.004, True), (0.03, False)])
def test_three_initialisations_tell_by_what_the_offsets_of_all_joints_scatter(scatter: float, found: bool) -> None:
    start = base(*([-0.08 + 0.004 * k, scatter * k, -scatter * k] for k in (-1, 0, 1)))
    three = SimpleNamespace(joints=("q1", "q2", "q3"))
    named = shared_offset(start, three, list(catalogue().values()), dict.fromkeys(three.joints, FINGER))
    assert (named is not None) == found
    assert named is None or named.effects[0].joints == ("q1",)


def test_one_initialisation_tells_nothing() -> None:
    assert common_offsets(base([-0.08, 0.01]), SIZES) == ()


def test_an_offset_of_the_first_joint_may_as_well_be_a_mount_that_leans(tmp_path: Path) -> None:
    offset = find_effect("position_offset")
    folder = simulated(tmp_path, Size(), offset, {"offset": 0.04}, repeats=4).folder
    described = yaml.safe_load((folder / "recording.yaml").read_text())
    for k, trial in enumerate(described["trials"]):
        trial["initialisation"] = k // 2
    (folder / "recording.yaml").write_text(yaml.safe_dump(described))
    effects = (offset, *(find_effect(name) for name in ("mount_tilt", "payload", "torque_bias", "coulomb_friction")))
    search = Search(*held_out_split(read_recording(folder)), np.full(1, NOISE), effects, lambda line: None)
    verdict = decide(find(search))
    assert named_by(verdict.chosen.effects) == {("position_offset", "a")}
    assert [named_by(one.effects) for one in verdict.rivals] == [{("mount_tilt", "a")}]
    (leaning,) = (one.fit.model.terms[-1].values for one in verdict.rivals)
    assert max(abs(value) for value in leaning.values()) == pytest.approx(0.04, abs=0.005)
