import json

import pytest

from tactile_cube.measurement.comparing.comparison import Comparison, as_json, compare
from tactile_cube.measurement.recordings.reading import read_recording
from tests.measurement.small_rig import write


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    recording = read_recording(write(tmp_path_factory.mktemp("recording")))
    return compare(recording, simulations=8, spread={"kd": 0.3, "offset": 0.02})


def test_comparison_json_has_what_others_script_against(comparison: Comparison) -> None:
    result = json.loads(json.dumps(as_json(comparison)))
    assert set(result["error"]) == {"overall", "joints"}
    assert set(result["error"]["joints"]) == {"a", "b"}
    assert {"overall", "joints", "source"} <= set(result["noise_floor"])
    assert result["noise_floor"]["source"] == "repeats"
    assert {"joint", "dimension", "regime", "error"} <= set(result["regimes"][0])
    assert [trial["name"] for trial in result["trials"]] == ["first", "second"]
    assert set(result["trials"][0]["error"]["joints"]) == {"a", "b"}


def test_the_floor_holds_the_step_size_error(comparison: Comparison) -> None:
    assert all(value > 0 for value in comparison.floor.step_size.values())


def test_the_band_holds_a_share_of_the_samples(comparison: Comparison) -> None:
    assert comparison.band is not None
    assert 0.0 <= comparison.band.inside <= 1.0
    assert all((high > low).all() for low, high in zip(comparison.band.low, comparison.band.high, strict=True))


def test_there_is_a_sentence_for_each_joint(comparison: Comparison) -> None:
    assert sorted(line[0] for line in comparison.sentences) == ["a", "b"]
