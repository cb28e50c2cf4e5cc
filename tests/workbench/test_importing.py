"""Logs on their way into the workbench."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import polars
import pytest
from scipy.io import savemat

import tactile_cube
from tactile_cube.api.comparison import run_recording
from tactile_cube.api.job import worded_job
from tactile_cube.errors import InputError
from tactile_cube.measurement.sources.log_file import READERS
from tactile_cube.workbench import importing
from tactile_cube.workbench.importing import LOGS, Waiting, import_logs, kept, settings_of
from tactile_cube.workbench.state import Workbench
from tests.measurement.small_rig import URDF, table
from tests.measurement.sources.bare_joint import played
from tests.measurement.sources.test_mjcf_import import ARM, POSITION

GAINS = {"kp": 3.0, "kd": 0.2}
HEAD = "t,a_cmd,a_pos,b_cmd,b_pos\n"
ROWS = [f"{0.01 * k:.2f},0.{k % 7},0.{k % 7},0.{k % 5},0.{k % 5}" for k in range(200)]


def waiting(folder: Path, text: str) -> Waiting:
    return Waiting().with_files([kept(folder, "run.csv", text.encode()), kept(folder, "rig.urdf", URDF.encode())])


def test_a_preview_shows_rows_and_guesses_columns(tmp_path: Path) -> None:
    seen = waiting(tmp_path, HEAD + "\n".join(ROWS)).preview()
    assert seen is not None
    assert seen.columns == ["t", "a_cmd", "a_pos", "b_cmd", "b_pos"]
    assert seen.rows[1] == [0.01, 0.1, 0.1, 0.1, 0.1]
    assert list(seen.guess) == ["time", "a", "b"]
    assert known(seen.guess["b"]) == {"command": "b_cmd", "position": "b_pos"}


def known(columns: dict[str, str]) -> dict[str, str]:
    return {signal: column for signal, column in columns.items() if column}


def test_what_the_names_leave_open_is_a_doubt_and_no_error(tmp_path: Path) -> None:
    seen = waiting(tmp_path, (HEAD + "\n".join(ROWS)).replace("a_", "x_").replace("b_", "y_")).preview()
    assert seen is not None
    assert known(seen.guess["a"]) == {}
    assert "of which joint" in seen.doubt


def test_without_a_column_of_commands_it_may_be_a_swing(tmp_path: Path) -> None:
    (tmp_path / "swing.csv").write_text("time,angle\n0,0.1\n0.01,0.2\n")
    seen = Waiting((tmp_path / "swing.csv",), robot="pendulum").preview()
    assert seen is not None
    assert (seen.mode, list(seen.guess)) == ("free", ["time", "pendulum"])
    assert "no column of commands" in seen.doubt


def test_without_a_column_of_commands_torques_are_the_commands(tmp_path: Path) -> None:
    (tmp_path / "driven.csv").write_text("time,torque,position\n0,0.1,0.1\n0.01,0.2,0.2\n")
    seen = Waiting((tmp_path / "driven.csv",), robot="pendulum").preview()
    assert seen is not None
    assert (seen.mode, known(seen.guess["pendulum"])) == ("torque", {"command": "torque", "position": "position"})
    assert "torques are taken for the commands" in seen.doubt


def test_columns_that_are_said_are_taken(tmp_path: Path) -> None:
    swapped = {"time": "t", "a": {"command": "b_cmd", "position": "b_pos"}}
    given = waiting(tmp_path, HEAD + "\n".join(ROWS)).settings | {"controller": GAINS, "columns": swapped}
    recording, understood = import_logs(tmp_path / "out", given)
    assert recording.joints == ("a",)
    assert any(line.startswith("guess: a command: b_cmd [rad] (values") for line in understood)


def test_an_error_names_the_row(tmp_path: Path) -> None:
    logs = waiting(tmp_path, HEAD + "\n".join([*ROWS[:50], ROWS[20], *ROWS[51:]]))
    with pytest.raises(InputError, match=r"run.csv: column 't', row 50: time runs backwards"):
        import_logs(tmp_path / "out", logs.settings | {"controller": GAINS})
    assert not (tmp_path / "out").exists()


def test_page_command_and_program_write_the_same_recording(tmp_path: Path) -> None:
    for number in range(2):
        columns = {name.replace(".", "_"): values for name, values in table(number).items() if "torque" not in name}
        polars.DataFrame(columns).write_csv(tmp_path / f"sines_{number}.csv")
    (tmp_path / "rig.urdf").write_text(URDF)
    typed = {
        "controller.kp": "25, 12", "controller.kd": "0.2 0.1", "controller.mode": "position", "read": "before",
        "controller.rate_hz": "1000", "nominal.static_friction": "0.01", "initialisation": "0 1", "length": "2",
    }  # fmt: skip
    files = sorted(tmp_path.glob("*.csv"))
    page = Waiting().with_files([*files, tmp_path / "rig.urdf"])
    import_logs(tmp_path / "page", settings_of(typed) | page.settings)
    words = [
        "source=csv", f"source.files=[{tmp_path}/*.csv]", f"source.urdf={tmp_path}/rig.urdf",
        "source.controller.kp=[25, 12]", "source.controller.kd=[0.2, 0.1]", "source.controller.rate_hz=1000",
        "source.nominal.static_friction=0.01", "source.initialisation=[0, 1]", "source.length=2",
    ]  # fmt: skip
    run_recording(worded_job("record", [*words, f"out={tmp_path}/command"]))
    values = settings_of(typed) | {"files": [f"{tmp_path}/*.csv"], "urdf": str(tmp_path / "rig.urdf")}
    given = {f"source.{key}": value for key, value in values.items()}
    recording = tactile_cube.record(tmp_path / "program", source="csv", values=given)[""]
    assert recording.gains.kp.tolist() == [25.0, 12.0]
    text = (tmp_path / "command" / "recording.yaml").read_text()
    for other in ("page", "program"):
        assert (tmp_path / other / "recording.yaml").read_text() == text
    assert "read: before" in text
    assert "shown_in" not in text, "a log in rad"
    for file in sorted((tmp_path / "command" / "trials").iterdir()):
        assert (tmp_path / "page" / "trials" / file.name).read_bytes() == file.read_bytes()


def test_the_page_takes_every_kind_of_log_that_the_command_reads(tmp_path: Path) -> None:
    assert tuple(READERS) == LOGS
    columns = {name.replace(".", "_"): values for name, values in table().items()}
    polars.DataFrame(columns).write_csv(tmp_path / "run.tsv", separator="\t")
    (tmp_path / "run.json").write_text(json.dumps({name: values.tolist() for name, values in columns.items()}))
    np.savez(tmp_path / "run.npz", **columns)  # type: ignore[arg-type]
    savemat(tmp_path / "run.mat", columns)
    polars.DataFrame(columns).write_parquet(tmp_path / "run.parquet")
    for ending in (".tsv", ".json", ".npz", ".mat", ".parquet"):
        file = kept(tmp_path / "dropped", f"run{ending}", (tmp_path / f"run{ending}").read_bytes())
        seen = Waiting((file,), tmp_path / "rig.urdf", robot="wheel")
        assert seen.with_files([file]).logs == (file,)
        assert import_logs(tmp_path / ending, {**two_joints(tmp_path), "files": [str(file)]})[0].joints == ("a", "b")
    rig = kept(tmp_path / "dropped", "arm.xml", ARM.replace("ACTUATORS", POSITION).encode())
    recording, said = import_logs(tmp_path / "out", seen.with_files([rig]).settings)
    assert (recording.joints, recording.gains.kp.tolist()) == (("a", "b"), [3.0, 2.0])
    assert any("arm.xml, where you state none" in line for line in said)


def test_a_recording_keeps_the_unit_of_its_log(tmp_path: Path) -> None:
    log = played("pendulum")
    log |= {name: np.degrees(log[name]) for name in ("goal", "position")}
    polars.DataFrame({f"{name}_deg" if name != "time" else name: values for name, values in log.items()}).write_csv(
        tmp_path / "run.csv"
    )
    recording, _ = import_logs(tmp_path / "out", Waiting((tmp_path / "run.csv",), robot="pendulum").settings)
    assert (recording.units, recording.shown) == ({"pendulum": "rad"}, {"pendulum": "deg"})
    assert np.allclose(recording.trials[0].position[:, 0], np.radians(log["position"]), atol=1e-9)


def test_added_logs_leave_every_signal_of_the_trials_before(tmp_path: Path) -> None:
    columns = {name.replace(".", "_"): values for name, values in table().items()}
    columns |= {"a_link_position": columns["a_position"] + 0.1, "b_feedforward": 0.01 + columns["b_position"]}
    polars.DataFrame(columns).write_csv(tmp_path / "run.csv")
    given = {**two_joints(tmp_path), "files": [str(tmp_path / "run.csv")]}
    first, _ = import_logs(tmp_path / "first", given)
    both, _ = import_logs(tmp_path / "both", given, first)
    for trial in both.trials:
        for signal in ("torque", "link_position", "feedforward"):
            np.testing.assert_array_equal(getattr(trial, signal), getattr(first.trials[0], signal))


def two_joints(folder: Path) -> dict[str, Any]:
    (folder / "rig.urdf").write_text(URDF)
    return {"urdf": str(folder / "rig.urdf"), "controller": GAINS}


def test_files_of_lerobot_are_told_apart_by_what_they_hold(tmp_path: Path) -> None:
    rows = [[0.1 * np.sin(0.1 * k), 0.1 * np.cos(0.1 * k)] for k in range(100)]
    frame = {"timestamp": [k / 30 for k in range(100)], "action": rows, "observation.state": rows}
    polars.DataFrame(frame).write_parquet(tmp_path / "episode.parquet")
    names = {"names": ["a.pos", "b.pos"]}
    info = json.dumps({"features": {"action": names, "observation.state": names}})
    arm = json.dumps({"a": {"range_min": 0, "range_max": 4000}, "b": {"range_min": 0, "range_max": 4000}})
    dropped = [
        ("info.json", info.encode()),
        ("chunk-000_file-000.parquet", (tmp_path / "episode.parquet").read_bytes()),
    ]
    files = [kept(tmp_path / "dropped", *one) for one in [*dropped, ("arm.json", arm.encode())]]
    found = Waiting().with_files(files)
    assert [one.name for one in found.logs] == ["chunk-000_file-000.parquet"]
    assert found.calibration == files[-1]
    (tmp_path / "rig.urdf").write_text(URDF)
    seen = found.with_files([tmp_path / "rig.urdf"]).preview()
    assert seen is not None
    assert known(seen.guess["b"]) == {"command": "action.b.pos", "position": "observation.state.b.pos"}


def test_one_joint_needs_no_urdf(tmp_path: Path) -> None:
    polars.DataFrame(played("pendulum")).write_csv(tmp_path / "run.csv")
    bare = Waiting((tmp_path / "run.csv",))
    assert bare.lacks == ["the URDF of the rig, or a choice of one joint"]
    chosen = Waiting(bare.logs, robot="pendulum")
    assert import_logs(tmp_path / "out", chosen.settings)[0].joints == ("pendulum",)
    (tmp_path / "rig.urdf").write_text(URDF)
    assert chosen.with_files([tmp_path / "rig.urdf"]).robot is None, "the last one said counts"


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("gear", "4.5", 4.5), ("controller.kp", "25,12", [25.0, 12.0]), ("controller.kp", " 25 12 ", [25.0, 12.0]),
        ("initialisation", "0", [0]), ("initialisation", "0;1", [0, 1]), ("angle_unit", "4096", 4096),
        ("angle_unit", "range", "range"), ("read", "after", "after"), ("servo", "sts3215", "sts3215"),
    ],
)  # fmt: skip
def test_what_is_typed_becomes_a_setting(key: str, text: str, value: object) -> None:
    made = settings_of({key: text})
    assert (made["controller"]["kp"] if "." in key else made[key]) == value


def test_two_gains_of_one_joint_are_refused_and_named(tmp_path: Path) -> None:
    polars.DataFrame(played("pendulum")).write_csv(tmp_path / "run.csv")
    given = Waiting((tmp_path / "run.csv",), robot="wheel").settings | settings_of({"controller.kp": "4,5"})
    with pytest.raises(InputError, match=r"kp.*expected one number for all joints or 1, received \[4.0, 5.0\]"):
        import_logs(tmp_path / "out", given)


def test_trials_of_no_length_are_refused(tmp_path: Path) -> None:
    polars.DataFrame(played("pendulum")).write_csv(tmp_path / "run.csv")
    given = Waiting((tmp_path / "run.csv",), robot="wheel").settings | {"length": 1e-9}
    with pytest.raises(InputError, match=r"source.length=1e-09: pieces need 20 rows"):
        import_logs(tmp_path / "out", given)


def test_a_log_without_motion_is_refused_before_anything_is_fitted(tmp_path: Path) -> None:
    log = {name: 0.0 * values if name != "time" else values for name, values in played("wheel").items()}
    for k in range(2):
        polars.DataFrame(log).write_csv(tmp_path / f"run_{k}.csv")
    given = Waiting((tmp_path / "run_0.csv", tmp_path / "run_1.csv"), robot="wheel").settings
    recording, _ = import_logs(tmp_path / "out", given)
    with pytest.raises(InputError, match=r"out: no joint moves in any trial; record motion"):
        Workbench(recording)


def test_what_is_typed_and_no_number_is_named() -> None:
    with pytest.raises(InputError, match=r"^initialisation: '0 1.5': give a whole number for each file"):
        settings_of({"initialisation": "0 1.5"})
    for text in ("4.O", "1,,x", "${oc.env:HOME}", ""):
        with pytest.raises(InputError, match=r"^kp: .* is no number"):
            settings_of({"controller.kp": text})


def test_nothing_that_a_file_says_is_interpreted(tmp_path: Path) -> None:
    head = HEAD.replace("a_cmd", "${oc.env:HOME}").replace("b_cmd", "_target_")
    columns = {"time": "t", "a": {"command": "${oc.env:HOME}", "position": "a_pos"}}
    given = waiting(tmp_path, head + "\n".join(ROWS)).settings | {"controller": GAINS, "columns": columns}
    _, understood = import_logs(tmp_path / "out", given)
    assert any("a command: ${oc.env:HOME} [rad]" in line for line in understood)


def test_of_a_dropped_files_name_only_the_last_part_counts(tmp_path: Path) -> None:
    for name in ("../../out.csv", "/etc/out.csv", "..\\..\\out.csv"):
        assert kept(tmp_path / "dropped", name, b"t\n") == tmp_path / "dropped" / "out.csv"


def test_other_files_and_large_ones_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"effect.py: neither a log \(.csv, .* nor a mechanism"):
        kept(tmp_path, "effect.py", b"")
    with pytest.raises(InputError, match=r"run.mcap: a ROS bag; .*record source=mcap 'source.files=\[run.mcap\]'"):
        kept(tmp_path, "run.mcap", b"")
    monkeypatch.setattr(importing, "LARGEST", 10)
    with pytest.raises(InputError, match=r"large.csv: .* name its path instead"):
        kept(tmp_path, "large.csv", b"0" * 11)
    assert not list(tmp_path.iterdir())
