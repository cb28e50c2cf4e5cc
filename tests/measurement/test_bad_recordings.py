"""Every way in which a recording can be bad has a clear error or a stated warning: file, column, row, value."""

from pathlib import Path

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tests.measurement.small_rig import URDF, Table, write


def error_of(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_recording(folder)
    message = str(caught.value)
    assert "\n" not in message
    return message


def keep_rows(columns: Table, rows: np.ndarray) -> None:
    for name in columns:
        columns[name] = columns[name][rows]


def test_a_good_recording_has_no_warnings(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    assert recording.warnings == ()
    assert recording.joints == ("a", "b")
    assert recording.trials[0].position.shape == (300, 2)
    assert recording.trials[0].valid.all()


def test_missing_folder_and_missing_description(tmp_path: Path) -> None:
    assert "no such folder" in error_of(tmp_path / "nowhere")
    assert "recording.yaml: no such file" in error_of(tmp_path)


def test_missing_column_is_named(tmp_path: Path) -> None:
    message = error_of(write(tmp_path, spoil=lambda columns: columns.pop("b.position")))
    assert "first.parquet" in message
    assert "'b.position' is missing" in message


def test_missing_time_column_is_named(tmp_path: Path) -> None:
    assert "'time' is missing" in error_of(write(tmp_path, spoil=lambda columns: columns.pop("time")))


def test_missing_torque_of_one_joint_is_a_warning(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path, spoil=lambda columns: columns.pop("b.torque")))
    assert recording.trials[0].torque is None
    assert "b.torque" in recording.warnings[0]


def test_nan_is_named_with_its_row(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["a.position"][17] = np.nan

    message = error_of(write(tmp_path, spoil=spoil))
    assert "first.parquet" in message
    assert "'a.position', row 17: received nan" in message


def test_infinite_time_is_named_with_its_row(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["time"][30] = np.inf

    assert "'time', row 30: received inf" in error_of(write(tmp_path, spoil=spoil))


def test_text_in_a_csv_is_named_with_its_row(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["trials"][0]["file"] = "first.csv"

    write(tmp_path, change)
    rows = ["time,a.command,a.position,b.command,b.position"] + [f"{k / 100},0,0,0,0" for k in range(40)]
    rows[8] = "0.07,0,oops,0,0"
    (tmp_path / "first.csv").write_text("\n".join(rows))
    assert "first.csv: column 'a.position', row 7: expected a number, received 'oops'" in error_of(tmp_path)


def test_degrees_are_recognised_by_the_limits(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        for joint in "ab":
            for signal in ("command", "position"):
                columns[f"{joint}.{signal}"] *= 180 / np.pi

    message = error_of(write(tmp_path, spoil=spoil))
    assert "degrees" in message
    assert "'a.position', row" in message


def test_degrees_in_one_signal_only_are_recognised(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["b.command"] *= 180 / np.pi

    assert "'b.command'" in error_of(write(tmp_path, spoil=spoil))


def test_degrees_within_wide_limits_are_recognised_by_the_torque(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        for signal in ("command", "position"):
            columns[f"a.{signal}"] *= 180 / np.pi

    wide = URDF.replace('lower="-0.5" upper="0.5"', 'lower="-50" upper="50"')

    def change(data: dict) -> None:
        data["controller"]["kd"] = 1e-9

    assert "degrees" in error_of(write(tmp_path, change, spoil, wide))


def test_swapped_joints_are_recognised(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["a.position"], columns["b.position"] = columns["b.position"], columns["a.position"]

    message = error_of(write(tmp_path, spoil=spoil))
    assert "swapped" in message
    assert "'a.position'" in message


def test_a_flipped_sign_is_recognised(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["b.position"] *= -1

    message = error_of(write(tmp_path, spoil=spoil))
    assert "moves against its command" in message


def test_a_joint_that_never_moves_is_a_warning(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["b.position"] = np.full(300, 0.1)

    assert any("never changes" in line for line in read_recording(write(tmp_path, spoil=spoil)).warnings)


def test_an_unknown_joint_is_named_with_those_of_the_rig(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["joints"] = ["a", "elbow"]

    message = error_of(write(tmp_path, change))
    assert "joint 'elbow' is not in" in message
    assert "['a', 'b']" in message


def test_a_urdf_that_lacks_the_joint_is_named(tmp_path: Path) -> None:
    message = error_of(write(tmp_path, urdf=URDF.replace('name="b"', 'name="c"')))
    assert "'b' is not in" in message
    assert "rig.urdf" in message


def test_a_urdf_that_is_no_xml(tmp_path: Path) -> None:
    assert "rig.urdf: URDF: not well-formed XML" in error_of(write(tmp_path, urdf="<robot"))


def test_columns_of_a_joint_that_is_not_listed_are_a_warning(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["wrist.position"] = columns["a.position"]

    assert "'wrist' are ignored" in read_recording(write(tmp_path, spoil=spoil)).warnings[0]


def test_backwards_time_is_named_with_row_and_values(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["time"][50] = 0.485

    message = error_of(write(tmp_path, spoil=spoil))
    assert "'time', row 50: time runs backwards, from 0.49 s to 0.485 s" in message


def test_repeated_time_stamps_are_a_warning(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["time"][50] = columns["time"][49]

    assert any("repeated time stamps" in line for line in read_recording(write(tmp_path, spoil=spoil)).warnings)


def test_jitter_is_a_warning_and_is_resampled(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        jitter = np.random.default_rng(0).uniform(-0.002, 0.002, 300)
        columns["time"] = columns["time"] + jitter
        columns["a.position"] = 0.3 * np.sin(2 * np.pi * 0.8 * (columns["time"] - columns["time"][0]))
        columns["a.command"] = columns["a.position"].copy()

    recording = read_recording(write(tmp_path, spoil=spoil))
    trial = recording.trials[0]
    assert any("jitter" in line for line in recording.warnings)
    assert np.allclose(np.diff(trial.time), 0.01)
    assert np.abs(trial.position[:, 0] - 0.3 * np.sin(2 * np.pi * 0.8 * trial.time)).max() < 1e-3


def test_dropped_samples_are_a_warning_and_count_in_no_error(tmp_path: Path) -> None:
    recording = read_recording(
        write(tmp_path, spoil=lambda c: keep_rows(c, np.delete(np.arange(300), [100, 101, 200])))
    )
    trial = recording.trials[0]
    assert any("3 samples dropped" in line and "row 100" in line for line in recording.warnings)
    assert len(trial.time) == 300
    assert np.flatnonzero(~trial.valid).tolist() == [100, 101, 200]


def test_a_long_gap_is_an_error(tmp_path: Path) -> None:
    message = error_of(write(tmp_path, spoil=lambda c: keep_rows(c, np.delete(np.arange(300), np.arange(100, 150)))))
    assert "row 100" in message
    assert "split the trial" in message


def test_time_in_milliseconds_is_recognised(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["time"] *= 1000

    assert "milliseconds" in error_of(write(tmp_path, spoil=spoil))


def test_a_wrong_rate_is_an_error_that_says_the_right_one(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["rate_hz"] = 500

    assert "set rate_hz to 100" in error_of(write(tmp_path, change))


def test_a_trial_of_three_samples_is_an_error(tmp_path: Path) -> None:
    message = error_of(write(tmp_path, spoil=lambda c: keep_rows(c, np.arange(3))))
    assert "has 3 samples, last row 2" in message


def test_a_truncated_parquet_file_is_an_error(tmp_path: Path) -> None:
    path = write(tmp_path) / "first.parquet"
    path.write_bytes(path.read_bytes()[:-100])
    assert "first.parquet: not a complete .parquet file" in error_of(tmp_path)


def test_a_truncated_npz_file_is_an_error(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["trials"][0]["file"] = "first.npz"

    write(tmp_path, change)
    np.savez(tmp_path / "first.npz", time=np.arange(100.0))
    path = tmp_path / "first.npz"
    path.write_bytes(path.read_bytes()[:-50])
    assert "not a complete NPZ file" in error_of(tmp_path)


def test_an_npz_file_with_objects_is_never_unpickled(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["trials"][0]["file"] = "first.npz"

    write(tmp_path, change)
    np.savez(tmp_path / "first.npz", time=np.array([{"a": 1}], dtype=object), allow_pickle=True)
    assert "NPZ file of plain arrays" in error_of(tmp_path)


@pytest.mark.parametrize("gain", ["kp", "torque_limit"])
def test_gains_of_zero_are_an_error(tmp_path: Path, gain: str) -> None:
    def change(data: dict) -> None:
        data["controller"][gain] = [3.0, 0.0]

    message = error_of(write(tmp_path, change))
    assert f"'controller.{gain}': received 0 for b" in message


def test_damping_of_zero_is_a_warning(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["controller"]["kd"] = 0.0

    assert any("kd" in line and "no damping" in line for line in read_recording(write(tmp_path, change)).warnings)


def test_gains_for_the_wrong_number_of_joints_are_an_error(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["controller"]["kp"] = [3.0, 3.0, 3.0]

    assert "one number for all joints or 2" in error_of(write(tmp_path, change))


def test_an_executable_yaml_tag_is_refused_and_not_run(tmp_path: Path) -> None:
    write(tmp_path)
    target = tmp_path / "owned"
    text = (tmp_path / "recording.yaml").read_text()
    (tmp_path / "recording.yaml").write_text(text + f"source: !!python/object/apply:os.system ['touch {target}']\n")
    message = error_of(tmp_path)
    assert "only plain data is read" in message
    assert "line" in message
    assert not target.exists()


def test_a_misspelt_key_is_named(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["controler"] = data.pop("controller")

    assert "controler" in error_of(write(tmp_path, change)) or "controller" in error_of(tmp_path)


def test_a_trial_file_outside_the_folder_is_refused(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["trials"][0]["file"] = "../first.parquet"

    assert "outside the recording's folder" in error_of(write(tmp_path / "inner", change))


def test_a_wrong_value_is_named_with_key_and_value(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["rate_hz"] = "fast"

    message = error_of(write(tmp_path, change))
    assert "'rate_hz'" in message
    assert "'fast'" in message
