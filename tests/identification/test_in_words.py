"""What the answer says in a sentence."""

from pathlib import Path
from typing import Any

import pytest

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.in_words import (
    OPENING,
    UNRELATED,
    answer,
    disturbed,
    headline,
    left_over,
    restated,
    sets_in_words,
)
from tactile_cube.measurement.recordings.reading import read_recording
from tests.measurement.small_rig import write


def result(verdict: str, with_effects: float = 4.3e-3, black_box: float = 0.0) -> dict[str, Any]:
    error = {"nominal": 0.02, "refitted": 0.01, "with_effects": with_effects, "noise_floor": 3e-4}
    return {"verdict": verdict, "error": error, "unexplained": [{"joint": "q1", "black_box": black_box}]}


def test_sets_of_effects_are_told_as_sets() -> None:
    assert sets_in_words([["a@q1", "b@q2"], ["c@q1"]]) == "a@q1 and b@q2, or c@q1"


def test_what_is_left_stands_in_the_headline() -> None:
    assert left_over(result("missing_effect")) == " (4.3 mrad remain, 14 noise floors)"
    assert left_over(result("missing_effect", 3.3e-4)) == ""
    assert left_over(result("partly_explained")) == left_over(result("missing_effect"))
    assert left_over(result("unknown_effect")) == ""


def test_an_unstable_machine_is_told_by_short_windows() -> None:
    unstable = result("missing_effect") | {"error_over_noise": {"with_effects": 1.05}}
    assert left_over(unstable) == " (1.05 sensor noises remain in short windows; in a free run it deviates by 4.3 mrad)"


def test_the_error_over_noise_is_stated_as_the_workbench_states_it_and_degrees_stay_degrees() -> None:
    found = result("adequate") | {"effects": [], "unexplained": [], "units": {"q1": "rad"}, "shown_in": {"q1": "deg"}}
    text = answer(found | {"error_over_noise": {"refitted": 4.834, "with_effects": 1.047}}, None)
    assert "over sensor noise in short windows: 4.83 with constants refitted, 1.05 with the recommended model" in text
    assert "1.15 deg as stated" in text


def test_constants_found_far_from_what_was_stated_are_told(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))  # kp 3, kd 0.2
    found = {
        "kp": (3.3, 3.2, 3.4),
        "kd": (0.3, 0.29, 0.31),
        "static_friction": (0.02, 0.0, 0.04),
        "torque_limit": (9.0,) * 3,
    }
    values = {key: {"a": {"value": v, "low": low, "high": high, "unit": "x"}} for key, (v, low, high) in found.items()}
    model = ModelFile.model_validate({"format": 1, "rig": "x", "joints": ["a", "b"], "values": values})
    assert restated(recording, model) == ["kd at a 0.3 [0.29, 0.31], not 0.2 x, or viscous friction beside it"]


@pytest.mark.parametrize(("share", "said"), [(0.0, UNRELATED), (0.4, OPENING["unknown_effect"])])
def test_an_unknown_effect_is_claimed_only_where_signals_show_one(share: float, said: str) -> None:
    assert headline(result("unknown_effect", black_box=share)) == said


def test_several_effects_are_told_as_several() -> None:
    one, other = ({"name": name, "joints": ["q1"]} for name in ("backlash", "payload"))
    assert "it is this one" in headline(result("missing_effect") | {"effects": [one, one]}), "one law at two joints"
    assert "they are these" in headline(result("missing_effect") | {"effects": [one, other]})


def test_what_follows_no_model_is_told_with_the_line_that_leaves_it_out() -> None:
    one = {"trial": "holds_0", "start": 0.8, "end": 2.8, "joint": "q1", "error": 111.2, "usual": 1.62, "repeats": 2}
    (left_out,) = disturbed({"left_out": [one]})
    assert left_out.startswith(
        "Left out: holds_0 from 0.80 to 2.80 s follows no model, though 2 other runs of its command do. q1's error"
    )
    assert "`exclude: [[0.80, 2.80]]`" in left_out
    (suspected,) = disturbed({"suspected": [one | {"repeats": 0}]})
    assert suspected.startswith("Not left out: holds_0")
    assert "and nothing repeats it" in suspected
