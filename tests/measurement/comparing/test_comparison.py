import json
from pathlib import Path

import pytest

from tactile_cube.measurement.comparing import comparison as module
from tactile_cube.measurement.comparing.comparison import USUAL_STEP, Comparison, compare_recording, comparison_json
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.visualization.comparison_report import outcome
from tests.measurement.small_rig import setting, table, write


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    recording = read_recording(write(tmp_path_factory.mktemp("recording")))
    return compare_recording(recording, simulations=8, spread={"kd": 0.3, "offset": 0.02})


def test_comparison_json_has_what_others_script_against(comparison: Comparison) -> None:
    result = json.loads(json.dumps(comparison_json(comparison)))
    assert set(result["error"]) == {"overall", "joints"}
    assert set(result["error"]["joints"]) == {"a", "b"}
    assert {"overall", "joints", "source"} <= set(result["noise_floor"])
    assert result["noise_floor"]["source"] == "repeats"
    assert {"joint", "dimension", "regime", "error"} <= set(result["regimes"][0])
    assert [trial["name"] for trial in result["trials"]] == ["first", "second"]
    assert set(result["trials"][0]["error"]["joints"]) == {"a", "b"}


def test_the_band_holds_a_share_of_the_samples(comparison: Comparison) -> None:
    assert comparison.band is not None
    assert 0.0 <= comparison.band.inside <= 1.0
    assert all((high > low).all() for low, high in zip(comparison.band.low, comparison.band.high, strict=True))


@pytest.mark.parametrize(("noise", "step", "used"), [(4e-4, None, 0.002), (1e-6, None, 0.00025), (1e-6, 0.002, 0.002)])
def test_steps_are_shorter_where_the_sensors_would_show_their_error(noise, step, used, tmp_path) -> None:
    fine_encoder = setting({"sensors.position_resolution": noise})
    recording = read_recording(write(tmp_path, fine_encoder, lambda columns: columns.update(table(noise=noise))))
    comparison, usual = compare_recording(recording, step=step), compare_recording(recording, step=USUAL_STEP)
    assert comparison.step == pytest.approx(used)
    smaller = comparison.floor.step_size["a"] / usual.floor.step_size["a"]
    assert smaller == pytest.approx(1.0 if used == USUAL_STEP else 1.0 / (module.FINER - 1))
    assert (comparison.errors == usual.errors) == (used == USUAL_STEP)


def test_a_simulation_that_diverges_is_no_good_model(tmp_path: Path) -> None:
    recording = read_recording(
        write(tmp_path, setting({"controller.kp": 4e5, "controller.torque_limit": float("inf")}))
    )
    comparison = compare_recording(recording)
    assert comparison.diverged
    assert not comparison.at_the_floor
    assert "This simulation tells nothing: its own time step" in outcome(comparison)
