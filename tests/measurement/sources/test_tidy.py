"""Logs as people have them: each a few lines long, and what becomes of it."""

import json
from pathlib import Path

import numpy as np
import polars
import pytest
from scipy.io import savemat

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.recording import Recording
from tests.measurement.small_rig import URDF, table
from tests.measurement.sources.test_csv_files import DEGREE, ONE_JOINT, Frame, imported


def one_joint(time: float = 1.0, angle: float = 1.0) -> Frame:
    columns = table()
    return {"t": columns["time"] * time, "cmd": columns["a.command"] * angle, "pos": columns["a.position"] * angle}


def written(frame: Frame) -> str:
    return polars.DataFrame(frame).write_csv()


def agrees(recording: Recording, rows: slice = slice(None), trial: int = 0) -> bool:
    read, made = recording.trials[trial], table()
    pairs = ((read.position, "a.position"), (read.command, "a.command"))
    return all(found[:, 0] == pytest.approx(made[key][rows], abs=1e-5) for found, key in pairs)


def test_a_header_stands_below_a_preamble_and_above_its_units(tmp_path, capsys) -> None:
    rows = written(one_joint(1e3, DEGREE)).replace("t,cmd,pos\n", "t,cmd,pos\nms,deg,deg\n")
    assert agrees(imported(tmp_path, {"log.csv": f"Scope 3\nOperator,NN\nRate, 100\n\n{rows}"}, ONE_JOINT))
    shown = " ".join(capsys.readouterr().out.split())
    assert "preamble 3 lines above the header" in shown
    assert "row of units t [ms], cmd [deg], pos [deg]" in shown


@pytest.mark.parametrize("encoding", ["cp1252", "utf-16", "utf-8-sig"])
def test_a_degree_sign_is_one_in_every_encoding(encoding: str, tmp_path: Path) -> None:
    urdf = ONE_JOINT.replace('lower="-0.5" upper="0.5"', 'lower="-50" upper="50"')
    text = written(one_joint(angle=DEGREE)).replace("cmd,pos", "Soll [°],Ist [°]")
    (tmp_path / "log.csv").write_bytes(text.encode(encoding))
    assert agrees(imported(tmp_path, {}, urdf, files=[str(tmp_path / "log.csv")]))


def test_microseconds_are_no_seconds(tmp_path: Path) -> None:
    text = written(one_joint(1e6)).replace("t,", "t [µs],", 1)
    assert imported(tmp_path, {"log.csv": text}, ONE_JOINT).rate == pytest.approx(100.0)


@pytest.mark.parametrize("date", [True, False])
def test_times_of_day_are_seconds_across_midnight(date: bool, tmp_path: Path) -> None:
    frame = one_joint()
    seconds = frame["t"] + 86398.5
    clock = [f"{int(s) // 3600 % 24:02d}:{int(s) // 60 % 60:02d}:{s % 60:06.3f}" for s in seconds]
    dates = {"Date": [f"2026-01-0{1 + int(s // 86400)}" for s in seconds]} if date else {}
    columns = {**dates, "Time": clock, "cmd": frame["cmd"], "pos": frame["pos"]}
    assert agrees(imported(tmp_path, {"log.csv": polars.DataFrame(columns).write_csv()}, ONE_JOINT))


def test_equal_rows_of_a_polled_log_are_left_out_and_counted(tmp_path, capsys) -> None:
    polled = {name: np.repeat(values, 6) for name, values in one_joint().items()}
    assert agrees(imported(tmp_path, {"log.csv": polled}, ONE_JOINT))
    assert "1500 of 1800 rows repeat the row before" in " ".join(capsys.readouterr().out.split())


def test_a_pause_and_a_restart_of_time_cut_a_log(tmp_path: Path) -> None:
    frame = one_joint()
    frame["t"] = np.concatenate([frame["t"][:100], frame["t"][100:200] + 3.7, frame["t"][:100]])
    recording = imported(tmp_path, {"log.csv": frame}, ONE_JOINT)
    assert [len(trial.time) for trial in recording.trials] == [100, 100, 100]
    for k in range(3):
        assert agrees(recording, slice(100 * k, 100 * k + 100), k)


@pytest.mark.parametrize("labels", [[0, 1, 2], ["a", "b", "c"]])
def test_a_column_of_episodes_cuts_a_log(labels: list[object], tmp_path: Path) -> None:
    frame = {**one_joint(), "episode_index": np.repeat(labels, 100)}
    recording = imported(tmp_path, {"log.csv": frame}, ONE_JOINT)
    assert [trial.name for trial in recording.trials] == [f"log_episode{label}" for label in labels]
    assert agrees(recording, slice(100, 200), 1)


def test_topics_in_rows_of_their_own_hold_the_last_command(tmp_path: Path) -> None:
    frame, late = one_joint(), 0.003
    rows = [(t + late, "/cmd", c) for t, c in zip(frame["t"], frame["cmd"], strict=True)]
    rows += [(t + 2 * late, "/pos", q) for t, q in zip(frame["t"], frame["pos"], strict=True)]
    long = "t,topic,value\n" + "\n".join(f"{t:.4f},{topic},{value:.7f}" for t, topic, value in sorted(rows))
    assert agrees(imported(tmp_path / "long", {"log.csv": long}, ONE_JOINT))
    wide = "t,cmd,pos\n" + "\n".join(
        f"{t:.4f},{value:.7f}," if topic == "/cmd" else f"{t:.4f},,{value:.7f}" for t, topic, value in sorted(rows)
    )
    assert agrees(imported(tmp_path, {"log.csv": wide}, ONE_JOINT))


@pytest.mark.parametrize("jitter", [0.0, 0.001])
def test_files_of_one_time_base_are_one_trial(jitter: float, tmp_path: Path) -> None:
    frame, shift = one_joint(), np.random.default_rng(0).uniform(0.0, jitter, 300)
    logs = {
        "x_command.csv": {"t": frame["t"], "a_command": frame["cmd"]},
        "x_position.csv": {"t": frame["t"] + shift, "a_position": frame["pos"]},
    }
    assert agrees(imported(tmp_path, dict(logs), ONE_JOINT))


def test_arrays_with_a_joint_axis_are_in_the_urdfs_order(tmp_path: Path) -> None:
    made = table()
    both = {key: np.stack([made[f"{j}.{key}"] for j in "ab"], axis=1) for key in ("command", "position")}
    np.savez(tmp_path / "log.npz", time=made["time"], q=both["position"], q_cmd=both["command"].T, name=np.array("run"))
    savemat(tmp_path / "log.mat", {"log": {"t": made["time"], "q": both["position"], "q_cmd": both["command"]}})
    for ending in ("npz", "mat"):
        recording = imported(tmp_path / ending, {}, URDF, files=[str(tmp_path / f"log.{ending}")])
        assert recording.trials[0].position[:, 1] == pytest.approx(made["b.position"], abs=1e-5)
        assert agrees(recording)


def test_a_matlab_file_is_unpacked_no_further_than_memory_holds(tmp_path, monkeypatch) -> None:
    savemat(tmp_path / "log.mat", {"t": np.zeros(100_000)}, do_compression=True)
    monkeypatch.setattr(limits, "NUMBERS", 1000)
    with pytest.raises(InputError, match=r"log\.mat: unpacks to more than"):
        imported(tmp_path, {}, files=[str(tmp_path / "log.mat")])
    (tmp_path / "new.mat").write_bytes(b"MATLAB 7.3 MAT-file")
    with pytest.raises(InputError, match=r"version 7\.3; write it by save"):
        imported(tmp_path, {}, files=[str(tmp_path / "new.mat")])


@pytest.mark.parametrize("timed", [True, False])
def test_json_of_a_servo_bench_is_read_up_to_where_torque_is_off(timed: bool, tmp_path: Path) -> None:
    frame = one_joint()
    entries = [
        {"goal_position": c, "position": q, "torque_enable": k < 200, "load": 0.0, "input_volts": 12.0}
        | ({"timestamp": t} if timed else {})
        for k, (t, c, q) in enumerate(zip(*frame.values(), strict=True))
    ]
    text = json.dumps({"motor": "servo", "kp": 8, "dt": 0.01, "entries": entries})
    recording = imported(tmp_path, {"log.json": text}, ONE_JOINT)
    assert agrees(recording, slice(0, 200))
    assert recording.trials[0].torque is None
    off = imported(tmp_path / "out", {"log.json": text}, ONE_JOINT, controller={"mode": "free"}).trials[0]
    assert off.position[:, 0] == pytest.approx(table()["a.position"][200:], abs=1e-5)
    assert not off.command.any()


LISTS = ("action", "observation.state")


def lerobot(folder: Path, names: object) -> Path:
    """A data set of two episodes with a gripper in ticks of its range."""
    (folder / "data/chunk-000").mkdir(parents=True)
    (folder / "meta").mkdir()
    both = [[[100 * q / 0.5, 50.0] for q in table(k)[f"a.{key}"]] for key in ("command", "position") for k in (0, 1)]
    columns = {
        "action": both[0] + both[1], "observation.state": both[2] + both[3], "timestamp": [*table()["time"]] * 2,
        "episode_index": [0] * 300 + [1] * 300,
    }  # fmt: skip
    polars.DataFrame(columns).write_parquet(folder / "data/chunk-000/file-000.parquet")
    features = {"action": {"names": names}, "observation.state": {"names": names}}
    (folder / "meta/info.json").write_text(json.dumps({"codebase_version": "v3.0", "fps": 100, "features": features}))
    return folder


@pytest.mark.parametrize("names", [["a.pos", "gripper.pos"], {"motors": ["main_a", "main_gripper"]}])
def test_a_lerobot_data_set_is_in_the_range_of_its_calibration(names: object, tmp_path: Path) -> None:
    data = [str(lerobot(tmp_path / "set", names))]
    recording = imported(tmp_path, {}, ONE_JOINT, files=data, angle_unit="range")
    assert len(recording.trials) == 2
    assert agrees(recording)
    (tmp_path / "arm.json").write_text(json.dumps({"a": {"range_min": 1000, "range_max": 3000}}))
    said = {"angle_unit": "range", "calibration": str(tmp_path / "arm.json")}
    trial = imported(tmp_path / "calibrated", {}, ONE_JOINT, files=data, **said).trials[0]
    assert trial.position[:, 0] == pytest.approx(table()["a.position"] / 0.5 * 1000 / 4096 * 2 * np.pi, abs=1e-5)


SO101 = Path(__file__).parents[4] / "shared/robots/TheRobotStudio_SO_ARM100_Simulation_SO101_so101_new_calib.urdf"


@pytest.mark.skipif(not SO101.is_file(), reason="needs ../shared/robots")
def test_a_lerobot_data_set_goes_with_the_so101s_official_file(tmp_path: Path) -> None:
    arm = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"]
    folder = lerobot(tmp_path / "set", [f"{joint}.pos" for joint in arm])
    file = folder / "data/chunk-000/file-000.parquet"
    frame = polars.read_parquet(file)
    six = {key: [[*row[:1], *row] + row[1:] * 3 for row in frame[key].to_list()] for key in LISTS}
    frame.with_columns(**{key: polars.Series(rows) for key, rows in six.items()}).write_parquet(file)
    said = {"files": [str(folder)], "angle_unit": "deg", "controller": {}}
    recording = imported(tmp_path, {}, SO101.read_text(), **said)
    assert set(recording.joints) == set(arm)
    assert recording.description.unknown == ["kp", "kd", "reflected_inertia"]
    places = [recording.joints.index(joint) for joint in ("shoulder_lift", "elbow_flex")]
    lift, elbow = recording.trials[1].position[:, places].T
    assert lift == pytest.approx(table(1)["a.position"] / 0.5 * 100 / DEGREE, abs=1e-5)
    assert elbow == pytest.approx(50.0 / DEGREE)


def test_a_gripper_of_lerobot_is_in_no_degrees(tmp_path: Path) -> None:
    urdf = URDF.replace('name="b"', 'name="gripper"').replace('lower="-0.6" upper="1.5"', 'lower="-0.2" upper="1.8"')
    data = [str(lerobot(tmp_path / "set", ["a.pos", "gripper.pos"]))]
    recording = imported(tmp_path, {}, urdf, files=data, angle_unit="deg")
    assert recording.trials[0].position[:, 1] == pytest.approx(0.8)
    assert recording.trials[0].position[:, 0] == pytest.approx(table()["a.position"] / 0.5 * 100 / DEGREE, abs=1e-5)


def test_lerobots_numbers_are_doubted_where_nobody_says_their_unit(tmp_path: Path) -> None:
    recording = imported(tmp_path, {}, ONE_JOINT, files=[str(lerobot(tmp_path / "set", None))], angle_unit=None)
    assert any("action[0], observation.state[0]: taken for deg; LeRobot writes" in line for line in recording.warnings)
    assert any("more columns than joints" in line for line in recording.warnings)


@pytest.mark.parametrize(
    ("name", "spoil"),
    [("torque_enable", 0), ("torque_status", 0), ("torque_current", 1), ("motor_voltage", 1), ("torque", 0)],
)
def test_what_is_no_torque_is_not_taken_for_one(name: str, spoil: int, tmp_path: Path) -> None:
    other = table()["a.torque"] if spoil else (np.arange(300) % 7 > 0).astype(float)
    frame = {**one_joint(), name: other}
    if name != "torque_enable":
        assert imported(tmp_path, {"log.csv": frame}, ONE_JOINT).trials[0].torque is None
    said = {"time": "t", "a": {"command": "cmd", "position": "pos", "torque": name}}
    with pytest.raises(InputError, match=rf"'{name}': .*no torque"):
        imported(tmp_path / "out", {"log.csv": frame}, ONE_JOINT, columns=said)


def test_a_motors_voltage_is_its_torque_and_damping(tmp_path: Path) -> None:
    frame = {"t": one_joint()["t"], "motor_voltage": table()["a.command"], "pos_rad": table()["a.position"]}
    controller = {"mode": "voltage", "kt": 0.05, "R": 2.0}
    recording = imported(tmp_path, {"log.csv": frame}, ONE_JOINT, controller=controller)
    assert recording.torque_controlled
    assert recording.trials[0].command[:, 0] == pytest.approx(0.025 * table()["a.command"], abs=1e-6)
    assert recording.gains.kd == pytest.approx([0.05**2 / 2.0])
    with pytest.raises(InputError, match=r"source\.controller\.kt=1\.0, R=None: mode=voltage needs kt"):
        imported(tmp_path / "out", {"log.csv": frame}, ONE_JOINT, controller={"mode": "voltage", "kt": 1.0})


def test_units_that_nothing_proves_are_doubts_and_those_that_are_said_are_none(tmp_path: Path) -> None:
    endless = ONE_JOINT.replace('type="revolute"', 'type="continuous"').replace('lower="-0.5" upper="0.5"', "")
    frame = {"t": one_joint()["t"], "pos": one_joint()["pos"], "tau": table()["a.torque"]}
    torque = {"mode": "torque"}
    doubts = imported(tmp_path, {"log.csv": frame}, endless, controller=torque).warnings
    assert [("taken for rad" in line, "taken for Nm" in line) for line in doubts] == [(True, False), (False, True)]
    said = imported(
        tmp_path / "out", {"log.csv": frame}, endless, controller=torque, angle_unit="rad", torque_unit="Nm"
    )
    assert said.warnings == ()


def servo(kp: float) -> Frame:
    """A pendulum of 0.5 N m behind a loop of kp, slow enough that its error is its weight."""
    time = np.arange(1500) / 100
    position = 0.45 * np.sin(2 * np.pi * 0.2 * time)
    weight = 0.5 * 9.81 * 0.1 * np.sin(position)
    return {"t": time, "cmd": position + weight / kp, "pos": position + np.random.default_rng(0).normal(0, 1e-4, 1500)}


HEAVY = ONE_JOINT.replace('xyz="0 0 -0.05"/><mass value="0.1"', 'xyz="0 0 -0.1"/><mass value="0.5"')


def test_gains_that_nobody_states_begin_where_the_log_has_them(tmp_path: Path) -> None:
    recording = imported(tmp_path, {"log.csv": servo(4.0)}, HEAVY, controller={"kp": None, "kd": None})
    assert recording.description.unknown == ["kp", "kd", "reflected_inertia"]
    assert recording.gains.kp[0] == pytest.approx(4.0, rel=0.15)
    assert recording.stated("kp", "a") is None
    assert any(
        "not stated, so unknown and to be identified, beginning with guesses: kp from" in line
        for line in recording.warnings
    )


@pytest.mark.parametrize(("factor", "doubted"), [(1.0, False), (3.0, False), (57.3, True), (1 / 57.3, True)])
def test_a_gain_in_other_units_is_doubted(factor: float, doubted: bool, tmp_path: Path) -> None:
    gains = {"kp": 4.0 * factor, "kd": 0.1}
    recording = imported(tmp_path, {"log.csv": servo(4.0)}, HEAVY, controller=gains)
    assert any("looks like" in line for line in recording.warnings) == doubted


def test_a_chirp_beyond_resonance_is_no_flipped_sign(tmp_path: Path) -> None:
    time = np.arange(2400) / 200
    command = 0.3 * np.sin(2 * np.pi * (1.5 * time + 0.02 * time**2))
    position, speed = np.zeros(2400), 0.0
    for k in range(1, 2400):  # resonance at 1 Hz
        speed += (4 * np.pi**2 * (command[k] - position[k - 1]) - 1.5 * speed) / 200
        position[k] = position[k - 1] + speed / 200
    beyond = slice(800, None)
    assert np.corrcoef(command[beyond], position[beyond])[0, 1] < -0.8
    frame = {"t": time[beyond], "cmd": command[beyond], "pos": position[beyond]}
    recording = imported(tmp_path, {"log.csv": frame}, ONE_JOINT)
    assert any("faster than the joint's resonance?" in line for line in recording.warnings)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("log.xlsx", "save it as CSV"),
        ("log.bag", "source=mcap"),
        ("log.h5", "as NPZ"),
        ("log.pdf", "a LeRobot data set"),
    ],
)
def test_a_file_that_is_not_read_says_what_to_do(name: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        imported(tmp_path, {name: "x"})


@pytest.mark.parametrize("text", ["[1, 2", "{}", '{"entries": []}', "[" * 100_000, '{"a": [[1], [1, 2]]}', "[1, 2]"])
def test_json_without_a_log_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"log\.json"):
        imported(tmp_path, {"log.json": text}, ONE_JOINT)


def test_a_folder_that_is_no_data_set_says_what_to_name(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    with pytest.raises(InputError, match=r"no meta/info\.json"):
        imported(tmp_path, {}, files=[str(tmp_path / "logs")])


def test_columns_left_aside_are_named_when_nothing_fits(tmp_path: Path) -> None:
    frame = polars.DataFrame({"t": [0.0] * 30, "cmd": [0.0] * 30, "pos": ["off"] * 30}).write_csv()
    with pytest.raises(InputError, match=r"no joint of the URDF has both.*\(pos: no numbers, left out\)"):
        imported(tmp_path, {"log.csv": frame}, ONE_JOINT)


def test_a_start_in_motion_counts_in_no_error_for_its_commands_are_unknown(tmp_path: Path) -> None:
    moving = one_joint()
    held = {name: np.concatenate([np.full(60, values[0]), values]) for name, values in moving.items()}
    held["t"] = np.arange(360) / 100.0
    recording = imported(tmp_path, {"moving.csv": moving, "held.csv": held}, ONE_JOINT)
    begun, rested = (next(t for t in recording.trials if t.name == name) for name in ("moving", "held"))
    assert not begun.valid[:40].any()
    assert begun.valid[40:].all()
    assert rested.valid.all()
    swing = imported(
        tmp_path / "torque", {"moving.csv": moving}, ONE_JOINT, controller={"mode": "torque"}, torque_unit="Nm"
    )
    assert swing.trials[0].valid.all(), "torques act at once"
