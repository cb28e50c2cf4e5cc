from pathlib import Path

import numpy as np
import polars
import pytest

from tactile_cube.measurement.recordings.reading import read_recording
from tests.measurement.small_rig import URDF, table, write

SHARED = Path(__file__).parents[4] / "shared" / "recordings"


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_csv_and_npz_are_read_like_parquet(tmp_path: Path, ending: str) -> None:
    def change(data: dict) -> None:
        data["trials"][0]["file"] = f"first.{ending}"

    write(tmp_path, change)
    columns = table(0)
    if ending == "csv":
        polars.DataFrame(columns).write_csv(tmp_path / "first.csv")
    else:
        np.savez(tmp_path / "first.npz", **columns)
    read = read_recording(tmp_path)
    assert np.allclose(read.trials[0].position[:, 0], columns["a.position"], atol=1e-12)


def test_samples_on_the_grid_are_taken_bit_for_bit(tmp_path: Path) -> None:
    def spoil(columns: dict) -> None:
        columns["time"] += 1234.5

    trial = read_recording(write(tmp_path, spoil=spoil)).trials[0]
    assert np.array_equal(trial.position[:, 1], table(0)["b.position"])
    assert trial.time[0] == 0.0


def test_gains_may_be_given_per_joint_or_by_name(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["controller"] |= {"kp": [3.0, 4.0], "kd": {"b": 0.3, "a": 0.2}}

    recording = read_recording(write(tmp_path, change))
    assert recording.gains.kp.tolist() == [3.0, 4.0]
    assert recording.gains.kd.tolist() == [0.2, 0.3]


def test_a_trial_may_have_gains_of_its_own(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["trials"][1]["controller"] = {"kp": 5.0}

    recording = read_recording(write(tmp_path, change))
    assert recording.trials[0].gains.kp.tolist() == [3.0, 3.0]
    assert recording.trials[1].gains.kp.tolist() == [5.0, 5.0]
    assert recording.trials[1].gains.kd.tolist() == [0.2, 0.2]


def test_the_velocity_is_that_of_the_motion(tmp_path: Path) -> None:
    trial = read_recording(write(tmp_path)).trials[0]
    omega = 2 * np.pi * 0.8
    expected = 0.3 * omega * np.cos(omega * (trial.time - 0.02))
    assert np.abs(trial.velocity(0.05)[5:-5, 0] - expected[5:-5]).max() < 0.06


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs ../shared/recordings")
@pytest.mark.parametrize("name", ["finger_plain", "finger_friction", "pendulum_delay"])
def test_the_shared_recordings_are_read_without_warnings(name: str) -> None:
    assert read_recording(SHARED / name).warnings == ()
    assert len(read_recording(SHARED / name / "validation").trials) == 4


def test_jumps_by_a_whole_turn_are_taken_out_and_said(tmp_path: Path) -> None:
    def wrapped(columns: dict) -> None:
        for key in ("a.command", "a.position"):
            columns[key] = (columns[key] + np.pi) % (2.0 * np.pi) - np.pi

    def wide(columns: dict) -> None:
        for key in ("a.command", "a.position"):
            columns[key] += 3.0

    def both(columns: dict) -> None:
        wide(columns)
        wrapped(columns)

    urdf = URDF.replace('lower="-0.5" upper="0.5"', 'lower="-6" upper="6"')
    true, found = (read_recording(write(tmp_path / n, spoil=s, urdf=urdf)) for n, s in (("w", wide), ("b", both)))
    assert not any("whole turn" in line for line in true.warnings)
    assert np.allclose(found.trials[0].position, true.trials[0].position, atol=1e-12)
    assert np.allclose(found.trials[0].command, true.trials[0].command, atol=1e-12)
    assert sum("whole turn" in line and "a." in line for line in found.warnings) == 2


def test_a_command_that_scatters_beside_a_smooth_position_may_be_the_position(tmp_path: Path) -> None:
    def exchanged(columns: dict) -> None:
        columns["a.command"], columns["a.position"] = columns["a.position"], columns["a.command"]

    (line,) = [one for one in read_recording(write(tmp_path, spoil=exchanged)).warnings if "exchanged" in one]
    assert "'a.command' scatters" in line
