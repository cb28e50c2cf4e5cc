"""Every way in which a recording can be bad has a clear error or a stated warning: file, column, row, value."""

import gzip
import io
import os
import re
import stat
from collections.abc import Callable
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import polars
import pytest

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.tables import read_table
from tests.measurement.small_rig import URDF, Table, setting, table, write


def error_of(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_recording(folder)
    message = str(caught.value)
    assert "\n" not in message
    return message


Spoil = Callable[[Table], object]
ANGLES = ("a.command", "a.position", "b.command", "b.position")


def put(name: str, rows: int | slice, value: float) -> Spoil:
    return lambda columns: columns[name].__setitem__(rows, value)


def scale(factor: float, *names: str) -> Spoil:
    return lambda columns: columns.update({name: columns[name] * factor for name in names})


def drop(*rows: int) -> Spoil:
    return lambda columns: columns.update({name: np.delete(column, rows) for name, column in columns.items()})


def swap(columns: Table) -> None:
    columns["a.position"], columns["b.position"] = columns["b.position"], columns["a.position"]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda columns: columns.pop("b.position"), ("first.parquet", "'b.position' is missing")),
        (lambda columns: columns.pop("time"), ("'time' is missing",)),
        (put("a.position", 17, np.nan), ("first.parquet", "'a.position', row 17: received nan")),
        (put("time", 30, np.inf), ("'time', row 30: received inf",)),
        (put("a.torque", 9, 1e300), ("'a.torque', row 9: received 1e+300",)),
        (scale(180 / np.pi, *ANGLES), ("degrees", "'a.position', row")),
        (scale(180 / np.pi, "b.command"), ("'b.command'",)),
        (swap, ("swapped", "'a.position'")),
        (scale(-1, "b.position"), ("moves against its command",)),
        (put("time", 50, 0.485), ("'time', row 50: time runs backwards, from 0.49 s to 0.485 s",)),
        (drop(*range(100, 150)), ("row 100", "split the trial")),
        (scale(1000, "time"), ("milliseconds",)),
        (drop(*range(3, 300)), ("has 3 samples, last row 2",)),
    ],
)
def test_columns_that_no_machine_gives_are_named_with_row_and_value(tmp_path, spoil, said) -> None:
    message = error_of(write(tmp_path, spoil=spoil))
    assert [words for words in said if words not in message] == []


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (put("b.position", slice(None), 0.1), "never changes"),
        (lambda columns: columns.update({"wrist.position": columns["a.position"]}), "'wrist' are ignored"),
        (lambda columns: columns.update({"a.position": 0.3 * columns["b.position"]}), "does the neighbour drag it"),
        (lambda columns: put("time", 50, columns["time"][49])(columns), "repeated time stamps"),
    ],
)
def test_what_is_odd_but_can_be_read_is_a_warning(tmp_path: Path, spoil: Spoil, said: str) -> None:
    assert any(said in line for line in read_recording(write(tmp_path, spoil=spoil)).warnings)


def test_a_good_recording_has_no_warnings(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    assert recording.warnings == ()
    assert recording.joints == ("a", "b")
    assert recording.trials[0].position.shape == (300, 2)
    assert recording.trials[0].valid.all()


def test_missing_torque_of_one_joint_is_a_warning(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path, spoil=lambda columns: columns.pop("b.torque")))
    assert recording.trials[0].torque is None
    assert "b.torque" in recording.warnings[0]


def test_text_in_a_csv_is_named_with_its_row(tmp_path: Path) -> None:
    rows = ["time,a.command,a.position,b.command,b.position"] + [f"{k / 100},0,0,0,0" for k in range(40)]
    rows[8] = "0.07,0,oops,0,0"
    with_first(tmp_path, "first.csv").write_text("\n".join(rows))
    assert "first.csv: column 'a.position', row 7: expected a number, not 'oops'" in error_of(tmp_path)


def test_degrees_within_wide_limits_are_recognised_by_the_torque(tmp_path: Path) -> None:
    spoil = scale(180 / np.pi, "a.command", "a.position")
    wide = URDF.replace('lower="-0.5" upper="0.5"', 'lower="-50" upper="50"')
    assert "degrees" in error_of(write(tmp_path, setting({"controller.kd": 1e-9}), spoil, wide))


def test_a_gain_57_times_too_large_is_no_angle_in_degrees_for_sure(tmp_path: Path) -> None:
    message = error_of(write(tmp_path / "gain", setting({"controller.kp": 171.9, "controller.kd": 1e-9})))
    assert "either controller.kp is 57.3 times too large, or this looks like degrees" in message


def test_a_urdf_that_lacks_the_joint_is_named(tmp_path: Path) -> None:
    message = error_of(write(tmp_path, urdf=URDF.replace('name="b"', 'name="c"')))
    assert "'b' is not in" in message
    assert "rig.urdf" in message


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
    recording = read_recording(write(tmp_path, spoil=drop(100, 101, 200)))
    trial = recording.trials[0]
    assert any("3 samples dropped" in line and "row 100" in line for line in recording.warnings)
    assert len(trial.time) == 300
    assert np.flatnonzero(~trial.valid).tolist() == [100, 101, 200]


def test_a_wrong_rate_is_an_error_that_says_the_right_one(tmp_path: Path) -> None:
    assert "set rate_hz to 100" in error_of(write(tmp_path, setting({"rate_hz": 500})))


def with_first(folder: Path, name: str) -> Path:
    """A recording whose first trial is in another file, and that file, which is not there yet."""
    write(folder, setting({"trials.0.file": name}))
    return folder / name


def test_a_damaged_file_or_folder_is_named(tmp_path: Path) -> None:
    assert "no such folder" in error_of(tmp_path / "nowhere")
    assert "recording.yaml: no such file" in error_of(tmp_path)
    path = write(tmp_path) / "first.parquet"
    path.write_bytes(path.read_bytes()[:-100])
    assert "first.parquet: not a complete .parquet file" in error_of(tmp_path)


def test_a_joint_without_inertia_is_named(tmp_path: Path) -> None:
    folder = write(tmp_path, setting({"nominal.reflected_inertia": 0.0}))
    urdf = folder / "rig.urdf"
    urdf.write_text(re.sub("<inertial>.*?</inertial>", "", urdf.read_text(), flags=re.DOTALL))
    assert "rig.urdf: joint 'a' moves no inertia" in error_of(tmp_path)


def test_an_npz_file_that_is_a_trap_is_refused(tmp_path: Path) -> None:
    path = with_first(tmp_path, "first.npz")
    np.savez(path, time=np.arange(100.0))
    path.write_bytes(path.read_bytes()[:-50])
    assert "not a complete NPZ file" in error_of(tmp_path)
    np.savez(path, time=np.array([{"a": 1}], dtype=object), allow_pickle=True)
    assert "NPZ file of plain arrays" in error_of(tmp_path), "never unpickled"
    header = io.BytesIO()
    claim = {"descr": "<f8", "fortran_order": False, "shape": (2_000_000_000,)}
    np.lib.format.write_array_header_1_0(header, claim)
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        archive.writestr("time.npy", header.getvalue() + bytes(800))
    assert "claims 1.6e+04 MB, 1.6e+04 of them for 'time'" in error_of(tmp_path)
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        archive.writestr("time.npy", b"\x93NUMPY\x02\x00" + (100_000_000).to_bytes(4, "little") + bytes(800))
    assert "'time.npy' has a header that no plain array needs" in error_of(tmp_path)


def test_damping_of_zero_is_a_warning(tmp_path: Path) -> None:
    folder = write(tmp_path, setting({"controller.kd": 0.0}))
    assert any("kd" in line and "no damping" in line for line in read_recording(folder).warnings)


HELD = {"size": 0.08, "mass": 0.2}
GRASP = {"position": [0.0, 0.0, 0.0]}


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("rate_hz", "fast", "key 'rate_hz': Input should be a valid number"),
        ("rate_hz", 1e9, "key 'rate_hz'"),
        ("controler", {}, "key 'controler'"),
        ("gravity", [np.nan, 0.0, -9.81], "key 'gravity.0'"),
        ("gravity", [0.0, 0.0, -1e300], "key 'gravity.2'"),
        ("joints", ["a", "elbow"], "joint 'elbow' is not in"),
        ("joints", ["a", "a"], "joints names ['a'] more than once"),
        ("controller.kp", [3.0, 0.0], "'controller.kp': received 0 for b"),
        ("controller.torque_limit", [1.0, 0.0], "'controller.torque_limit': received 0 for b"),
        ("controller.kp", [3.0, 3.0, 3.0], "one number for all joints or 2"),
        ("controller.kp", 1e300, "key 'controller.kp': received 1e+300 for a"),
        ("controller.kd", np.inf, "kd [inf, inf]; expected finite gains"),
        ("nominal.stiffness", [1e300, 25.0], "key 'nominal.stiffness': received 1e+300 for a"),
        ("nominal.reflected_inertia", np.inf, "key 'nominal.reflected_inertia'"),
        ("nominal.static_friction", np.nan, "key 'nominal.static_friction': received nan for a"),
        ("sensors.position_noise", np.inf, "key 'sensors.position_noise'"),
        ("object", HELD | {"mass": 1e300}, "key 'object.mass'"),
        ("object", HELD | {"mass": -1.0}, "key 'object.mass'"),
        ("object", HELD | {"com": [0.0, 0.0, np.inf]}, "key 'object.com.2'"),
        ("trials.0.object", GRASP | {"quaternion": [0, 0, 0, 0]}, "key 'trials.0.object'"),
        ("trials.0.force", {"joint": "a", "point": [0] * 3, "vector": [0, 0, np.nan]}, "key 'trials.0.force.vector.2'"),
        ("trials.0.touch", {"joint": "a", "angle": np.inf}, "key 'trials.0.touch.angle'"),
        ("coupled", {"b": {"joint": "a", "ratio": np.nan}}, "key 'coupled.b.ratio'"),
    ],
)
def test_a_wrong_value_is_named_with_its_key(tmp_path: Path, key: str, value: object, said: str) -> None:
    message = error_of(write(tmp_path, setting({key: value})))
    assert said in message
    assert str(tmp_path / "recording.yaml") in message


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("source: !!python/object/apply:os.system ['touch owned']", "only plain data is read"),
        ("rate_hz: 200", "the key 'rate_hz' stands twice"),
        ("object: {mass: 1e400}", "1e400 is larger than any number"),
        ("object: {mass: 1.0e+400}", "1.0e+400 is larger than any number"),
        ("source: " + "1:" * 100_000 + "1", "is larger than any number"),  # base 60, minutes of arithmetic
        ("object: {<<: [{mass: 1}, {mass: 1}]}", "'<<' is not read"),  # 10 levels of 10 fill any memory
        (f"source: [{'1,' * 220_000}]", "more than 200000 keys and values"),
        (f"source: {'[' * 60}", "50 within each other"),  # PyYAML refuses 100 000 itself from 6.0.4 on
        (f"source: {'x' * 2_000_000}", "MB; up to 2 MB are read here"),
    ],
)
def test_a_description_that_is_a_trap_is_refused_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    file = write(tmp_path) / "recording.yaml"
    file.write_text(f"{file.read_text()}{text}\n")
    assert said in error_of(tmp_path)
    assert not (tmp_path / "owned").exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("</robot>", "", "not well-formed XML"),
        ('mass value="0.1"', 'mass value="-0.1"', "link 'upper' has mass -0.1 kg"),
        ('mass value="0.1"', 'mass value="1e300"', "the mass of link 'upper' has value=\"1e300\""),
        ('mass value="0.1"', 'mass value="1e6"', "link 'upper' has mass 1e+06 kg"),
        ('ixx="1e-5"', 'ixx="-3e-5"', "link 'upper' has principal moments of inertia -3e-05, 1e-05, 1e-05"),
        ('ixx="1e-5"', 'ixx="nan"', "the inertia of link 'upper' has ixx=\"nan\""),
        ('xyz="0 0 -0.05"', 'xyz="0 0 1e300"', "it takes three numbers"),
        ('joint name="b"', 'joint name="a"', "two joints are called 'a'"),
        ('link name="lower"', 'link name="upper"', "two links are called 'upper'"),
        ('child link="lower"', 'child link="upper"', "link 'upper' has more than one parent joint"),
        ("<link ", "<a>" * 5000 + "</a>" * 5000 + "<link ", "nested too deeply"),
        ("<link ", '<joint name="x"/>' * 1001 + "<link ", "it has 1003 joints"),
    ],
)
def test_a_urdf_that_no_machine_has_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in URDF
    message = error_of(write(tmp_path, urdf=URDF.replace(old, new, 1)))
    assert said in message
    assert "rig.urdf" in message


def test_rounded_moments_of_a_thin_rod_and_a_mass_without_extent_are_bodies(tmp_path: Path) -> None:
    rod = URDF.replace('ixx="1e-5" iyy="1e-5" izz="1e-5"', 'ixx="0.334" iyy="0.333" izz="0.000"', 1)
    assert read_recording(write(tmp_path, urdf=rod.replace("1e-5", "0"))).warnings == ()


@pytest.mark.parametrize("name", ["recording.yaml", "rig.urdf", "first.parquet"])
@pytest.mark.parametrize("way", ["link", "loop", "pipe", "socket", "folder"])
def test_a_place_without_a_regular_file_in_the_folder_is_refused(tmp_path: Path, name: str, way: str) -> None:
    folder = write(tmp_path / "recording")
    (folder / name).rename(tmp_path / name)
    said = {"pipe": "is a pipe", "folder": "is a folder", "socket": "is a socket", "link": "lies outside of"}
    if way in ("link", "loop"):
        (folder / name).symlink_to(tmp_path / name if way == "link" else folder / name)
    elif way == "folder":
        (folder / name).mkdir()
    else:
        os.mkfifo(folder / name) if way == "pipe" else os.mknod(folder / name, stat.S_IFSOCK | 0o600)
    message = error_of(folder)
    loop = ("is no name of a file", "Too many levels of symbolic links")  # until Python 3.12, and later
    assert any(one in message for one in ([said[way]] if way in said else loop))
    assert name in message


@pytest.mark.parametrize("name", ["../{}", "{outside}/{}", "file://{outside}/{}", "trials/../../{}", "{}\0"])
@pytest.mark.parametrize("file", ["rig.urdf", "first.parquet"])
def test_a_name_that_leads_out_of_the_folder_is_refused(tmp_path: Path, name: str, file: str) -> None:
    write(tmp_path)
    change = {"trials.0.file" if file == "first.parquet" else "rig": name.format(file, outside=tmp_path)}
    message = error_of(write(tmp_path / "inner", setting(change)))
    assert "lies outside of" in message or "is no name of a file" in message


@pytest.mark.parametrize("ending", ["parquet", "csv", "npz"])
def test_a_table_is_refused_by_its_size_before_it_is_read(tmp_path, ending, monkeypatch) -> None:
    path, columns = with_first(tmp_path, f"first.{ending}"), table()
    if ending == "npz":
        np.savez(path, **columns)
    else:
        getattr(polars.DataFrame(columns), f"write_{ending}")(path)
    assert read_recording(tmp_path).trials[0].position.shape == (300, 2)
    monkeypatch.setattr(limits, "NUMBERS", 2 * 300 * 7)  # both trials
    assert len(read_recording(tmp_path).trials) == 2
    monkeypatch.setattr(limits, "NUMBERS", 2 * 300 * 7 - 1)
    assert "second.parquet: holds 7 columns, 2100 numbers" in error_of(tmp_path)
    monkeypatch.setattr(limits, "NUMBERS", 300 * 7 - 1)
    for reader in ("LazyFrame.collect", "read_csv"):
        monkeypatch.setattr(f"polars.{reader}", None)
    assert ("claims" if ending == "npz" else "holds 7 columns") in error_of(tmp_path)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"time," * 300_000, "a line is longer than 1 MB"),
        (b"time\n" + b"1" * 1_100_000, "a line is longer than 1 MB"),
        (b"time" + b",x" * 5000 + b"\n1\n", "holds 5001 columns"),
        (gzip.compress(b"time,a.command\n" + b"1,2\n" * 100), "is compressed; unpack it"),
    ],
    ids=["header", "row", "columns", "compressed"],
)
def test_a_csv_file_that_is_a_trap_is_refused(tmp_path: Path, content: bytes, said: str) -> None:
    with_first(tmp_path, "first.csv").write_bytes(content)
    assert said in error_of(tmp_path)


def test_a_name_with_an_asterisk_is_no_pattern(tmp_path: Path) -> None:
    """Polars would look for `*/first.parquet` in links that lead elsewhere too."""
    (tmp_path / "*").mkdir()
    polars.DataFrame(table()).write_parquet(with_first(tmp_path, "*/first.parquet"))
    (tmp_path / "link").symlink_to(write(tmp_path / "elsewhere"))
    assert read_recording(tmp_path).trials[0].position.shape == (300, 2)


def test_more_missing_samples_than_there_are_is_an_error(tmp_path: Path) -> None:
    """Gaps of 0.2 s at 100 kHz: 300 rows would become millions."""

    times = np.arange(300) * 1e-5 + 0.2 * (np.arange(300) // 4)
    folder = write(tmp_path, setting({"rate_hz": 1e5}), lambda columns: columns.update(time=times))
    assert "samples at rate_hz 100000 it has 300" in error_of(folder)


@pytest.mark.parametrize(("file", "reader"), [("trial.parquet", "scan_parquet"), ("trial.csv", "read_csv")])
def test_a_reader_that_panics_means_a_damaged_file(file, reader, tmp_path, monkeypatch) -> None:
    def panic(*_: object, **__: object) -> None:
        raise polars.exceptions.PanicException("Thrift out of range\nsecond line")

    frame = polars.DataFrame({"time": [0.0]})
    frame.write_parquet(tmp_path / file) if file.endswith("parquet") else frame.write_csv(tmp_path / file)
    monkeypatch.setattr(polars, reader, panic)
    with pytest.raises(InputError, match=rf"{file}: not a .*Thrift out of range$"):
        read_table(tmp_path / file)
