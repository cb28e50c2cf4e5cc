"""Logs as people have them: other names, units, separators and folders; what is understood, and what is asked."""

import re
from pathlib import Path

import numpy as np
import polars
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import RigJoint
from tactile_cube.measurement.recordings.tables import read_table
from tactile_cube.measurement.recordings.writing import write_recordings
from tactile_cube.measurement.sources import units
from tactile_cube.measurement.sources.source import rate_of, recording_tables, source_settings
from tactile_cube.measurement.sources.units import position_unit, same_unit
from tests.measurement.small_rig import URDF, table

DEGREE = 180 / np.pi
ONE_JOINT = re.sub(r'<link name="lower">.*?</link>|<joint name="b".*?</joint>', "", URDF, flags=re.DOTALL)
GAINS = {"kp": 3.0, "kd": 0.2, "torque_limit": 1.0}
COLUMNS = {"time": "t", "a": {"command": "goal1", "position": "pos1"}, "b": {"command": "goal2", "position": "pos2"}}
Frame = dict[str, np.ndarray]


def imported(folder: Path, logs: dict[str, Frame | str], urdf: str = URDF, **changes: object) -> Recording:
    """Write the logs (file name -> columns, or the text) and the URDF, import them as `record` does, read them back."""
    folder.mkdir(exist_ok=True)
    (folder / "rig.urdf").write_text(urdf)
    for name, log in logs.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if isinstance(log, str):
            (folder / name).write_text(log)
        else:
            polars.DataFrame(log).write_csv(folder / name)
    settings = {"files": [str(folder / name) for name in logs], "urdf": str(folder / "rig.urdf"), "controller": GAINS}
    write_recordings(folder / "out", recording_tables(source_settings("csv", settings | changes), "csv", 0))
    return read_recording(folder / "out")


def log(names: dict[str, str], time: str = "t", tick: float = 1.0, angle: float = 1.0, seed: int = 0) -> Frame:
    """Two joints' motion under other names and in other units."""
    columns = table(seed)
    scale = {"command": angle, "position": angle, "torque": 1.0}
    return {time: columns["time"] * tick} | {
        other: columns[own] * scale[own.rpartition(".")[2]] for own, other in names.items()
    }


NUMBERED = {"a.command": "goal1", "a.position": "pos1", "b.command": "goal2", "b.position": "pos2"}


@pytest.mark.parametrize(
    ("names", "time", "tick", "angle"),
    [
        (NUMBERED, "t", 1000.0, DEGREE),
        ({"a.command": "a_cmd_deg", "a.position": "a_deg", "b.command": "b_cmd_deg", "b.position": "b_deg"},
         "time", 1, DEGREE),
        ({"a.command": "a.goal", "a.position": "a", "b.command": "b.goal", "b.position": "b"},
         "timestamp_us", 1e6, 1.0),
        ({"a.command": "q_d_0", "a.position": "q_0", "b.command": "q_d_1", "b.position": "q_1"}, "stamp", 1e9, 1.0),
        ({"a.command": "desired[1] (rad)", "a.position": "measured[1] (rad)", "b.command": "desired[2] (rad)",
          "b.position": "measured[2] (rad)"}, "Time (s)", 1.0, 1.0),
        ({"a.command": "action.a.pos", "a.position": "observation.state.a.pos", "b.command": "action.b.pos",
          "b.position": "observation.state.b.pos"}, "timestamp", 1.0, DEGREE),
    ],
)  # fmt: skip
def test_names_and_units_of_other_programs_are_understood(names, time, tick, angle, tmp_path) -> None:
    recording = imported(tmp_path, {"log.csv": log(names, time, tick, angle)})
    assert recording.rate == pytest.approx(100.0)
    for k, joint in enumerate("ab"):
        assert np.allclose(recording.trials[0].position[:, k], table()[f"{joint}.position"], atol=1e-6)
        assert np.allclose(recording.trials[0].command[:, k], table()[f"{joint}.command"], atol=1e-6)


@pytest.mark.parametrize(("unit", "size"), [("mNm", 1e-3), ("Nmm", 1e-3), ("Ncm", 1e-2), ("N cm", 1e-2), ("Nm", 1.0)])
def test_torques_are_taken_where_all_joints_have_one_and_converted_by_their_names(unit, size, tmp_path) -> None:
    names = NUMBERED | {"a.torque": f"tau1 [{unit}]", "b.torque": f"tau2 [{unit}]"}
    trial = imported(tmp_path, {"log.csv": log(names)}).trials[0]
    assert trial.torque is not None
    assert np.allclose(trial.torque[:, 1], size * table()["b.torque"], atol=1e-6)


def test_units_have_their_size_in_the_si() -> None:
    known = units.ANGLE_UNITS | units.LENGTH_UNITS | units.TIME_UNITS | units.TORQUE_UNITS | units.FORCE_UNITS
    sizes = {"rad": 1.0, "deg": 0.0174532925, "turn": 6.28318531, "mrad": 1e-3, "m": 1.0, "mm": 1e-3, "um": 1e-6}
    sizes |= {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "Nm": 1.0, "mNm": 1e-3, "Ncm": 1e-2}
    assert known == pytest.approx(sizes | {"N": 1.0, "mN": 1e-3, "kN": 1e3}, rel=1e-8)


def test_command_and_position_may_be_in_different_units(tmp_path: Path) -> None:
    mixed = log(NUMBERED)
    mixed["pos1"], mixed["pos2"] = mixed["pos1"] * DEGREE, mixed["pos2"] * DEGREE
    trial = imported(tmp_path, {"log.csv": mixed}).trials[0]
    assert np.allclose(trial.position[:, 0], table()["a.position"], atol=1e-6)
    assert np.allclose(trial.command[:, 0], table()["a.command"], atol=1e-6)


def test_a_joint_that_hardly_moved_is_in_its_commands_unit(tmp_path: Path) -> None:
    stuck = log(NUMBERED, angle=DEGREE)
    stuck["pos1"] = 0.06 * stuck["pos1"]  # one degree of commanded 17: within the limits as radians too
    trial = imported(tmp_path, {"log.csv": stuck}).trials[0]
    assert np.ptp(trial.position[:, 0]) == pytest.approx(0.06 * np.ptp(table()["a.position"]), rel=1e-3)


def test_a_single_joint_needs_no_number_and_what_is_no_number_is_left_aside(tmp_path: Path) -> None:
    columns = table()
    lines = ["time;mode;soll;ist;temperatur"]
    for t, c, q in zip(columns["time"], columns["a.command"], columns["a.position"], strict=True):
        numbers = f"{c:.6f};{q:.6f};31.5".replace(".", ",")
        lines.append(f"2024-05-01 10:00:{t:06.3f};läuft;{numbers}")
    recording = imported(tmp_path, {"log.csv": "\n".join(lines)}, urdf=ONE_JOINT)
    assert recording.rate == pytest.approx(100.0)
    assert np.allclose(recording.trials[0].position[:, 0], columns["a.position"], atol=2e-6)


def test_rows_without_time_follow_one_another_at_the_rate_that_is_given(tmp_path: Path) -> None:
    untimed = log(NUMBERED)
    del untimed["t"]
    with pytest.raises(InputError, match=r"no column of time.*source\.rate=HZ"):
        imported(tmp_path, {"log.csv": untimed})
    assert imported(tmp_path, {"log.csv": untimed}, rate=100.0).trials[0].duration == pytest.approx(2.99)


def test_repeats_are_one_kind_and_numbers_that_mean_something_are_not(tmp_path: Path) -> None:
    logs: dict[str, Frame | str] = {f"steps_{k}.csv": log(NUMBERED, seed=k) for k in range(3)}
    for speed in (1, 2):
        other = log(NUMBERED)
        other["goal1"] = 0.2 * np.sin(speed * other["t"])
        logs[f"ramp_{speed}.csv"] = other
    logs["2024-05-01_10-00-00.csv"] = log(NUMBERED)
    kinds = [trial.kind for trial in imported(tmp_path, logs).trials]
    assert kinds == ["steps", "steps", "steps", "ramp_1", "ramp_2", "motion"]


def test_files_of_one_name_in_several_folders_stay_apart(tmp_path: Path) -> None:
    logs = {f"day{k}/run.csv": log(NUMBERED, seed=k) for k in (1, 2)}
    recording = imported(tmp_path, dict(logs))
    assert [trial.name for trial in recording.trials] == ["day1_run", "day2_run"]
    assert {trial.kind for trial in recording.trials} == {"run"}


def test_a_long_log_is_cut_into_trials(tmp_path: Path) -> None:
    trials = imported(tmp_path, {"log.csv": log(NUMBERED)}, length=1.0).trials
    assert [len(trial.time) for trial in trials] == [100, 100, 100]
    assert np.allclose(trials[1].position[:, 0], table()["a.position"][100:200], atol=1e-6)


def test_commanded_torques_need_no_gains(tmp_path: Path) -> None:
    names = {"a.torque": "tau_cmd1", "a.position": "pos1", "b.torque": "tau_cmd2", "b.position": "pos2"}
    recording = imported(tmp_path, {"log.csv": log(names)}, controller={"mode": "torque"})
    assert recording.torque_controlled
    assert np.allclose(recording.trials[0].command[:, 0], table()["a.torque"], atol=1e-6)


def test_a_failed_import_leaves_nothing_behind_and_names_the_users_file(tmp_path: Path) -> None:
    backwards = log(NUMBERED)
    backwards["t"][200] = 0.0
    with pytest.raises(InputError, match=r"bad\.csv: column 't', row 200: time runs backwards"):
        imported(tmp_path, {"bad.csv": backwards})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bad.csv", "rig.urdf"]


def test_one_bad_log_of_several_is_left_out_and_named(tmp_path: Path) -> None:
    backwards, wrong = log(NUMBERED), log(NUMBERED)
    backwards["t"][200] = 0.0
    wrong["pos1"] = wrong["pos1"] + 40.0
    logs = {"good.csv": log(NUMBERED), "better.csv": log(NUMBERED, seed=1), "bad.csv": backwards, "far.csv": wrong}
    recording = imported(tmp_path, dict(logs), angle_unit="rad")
    assert [trial.name for trial in recording.trials] == ["good", "better"]
    for said in (r"left out: .*bad\.csv: column 't', row 200: time runs", r"left out: .*far\.csv: .*far outside"):
        assert any(re.search(said, line) for line in recording.warnings)
    with pytest.raises(InputError, match="far outside"):
        imported(
            tmp_path / "most", {"good.csv": log(NUMBERED), **{f"far{k}.csv": wrong for k in range(3)}}, angle_unit="rad"
        )


def test_what_was_understood_is_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    imported(tmp_path, {f"steps_{k}.csv": log(NUMBERED | {"a.torque": "speed"}, "t", 1e3, DEGREE) for k in (0, 1)})
    shown = " ".join(capsys.readouterr().out.split())
    for row in (
        "time t [ms], 100 Hz steps of 10",
        "a command goal1 [deg] values -17.2 .. 17.2 and the joint's limits",
        "kinds steps x 2 file names and commands",
        "not used speed",
    ):
        assert row in shown


def test_degrees_that_are_said_to_be_radians_are_answered_with_the_setting(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"log\.csv: .*source\.angle_unit=deg"):
        imported(tmp_path, {"log.csv": log(NUMBERED, angle=DEGREE)}, angle_unit="rad")


def change_goal(frame: Frame) -> Frame:
    return {("soll_goal1" if name == "pos1" else name): values for name, values in frame.items()}


@pytest.mark.parametrize(
    ("changes", "spoil", "said"),
    [
        ({"columns": COLUMNS | {"time": "clock"}}, dict, "column 'clock' is missing"),
        ({"columns": COLUMNS | {"a": {"command": "goal1"}}}, dict, r"source\.columns\.a: position missing"),
        ({"columns": COLUMNS | {"c": COLUMNS["a"]}}, dict, r"source\.columns\.c: no such joint.*a, b"),
        ({"columns": COLUMNS | {"a": {"command": "goal1", "position": "pos1", "load": "x"}}}, dict, "a.load: unknown"),
        ({"columns": {"a": "goal1"}}, dict, r"source\.columns\.a=goal1: no mapping; expected source\.columns='{time"),
        ({"angle_unit": "range", "calibration": "no.json"}, dict, r"^no\.json: no such file$"),
        ({"angle_unit": "grad"}, dict, r"source\.angle_unit=grad: unknown; choose one of rad, deg"),
        ({"kind": ["one", "two"]}, dict, "2 values for 1 files"),
        (
            {"controller": {"mode": "current"}},
            dict,
            "source.controller.mode=current: expected 'position', 'torque', 'voltage' or 'free'",
        ),
        ({}, change_goal, "'goal1' and 'soll_goal1' could both be the command of 'a'"),
        ({}, lambda frame: {k.rstrip("12"): v for k, v in frame.items() if "2" not in k}, "of which joint"),
        ({}, lambda frame: {f"x{k}": v for k, v in enumerate(frame.values())}, "no joint of the URDF has both"),
    ],
)
def test_what_cannot_be_understood_is_asked_for(changes, spoil, said, tmp_path) -> None:
    with pytest.raises(InputError, match=said):
        imported(tmp_path, {"log.csv": spoil(log(NUMBERED))}, **changes)


def test_a_pattern_without_a_match_says_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nothing-\*\.csv matches no file; .* has log\.csv, rig\.urdf"):
        imported(tmp_path, {"log.csv": log(NUMBERED)}, files=[str(tmp_path / "nothing-*.csv")])


@pytest.mark.parametrize(
    "names", [("motor_angle_rad", "joint_angle_rad", "goal_rad"), ("motor_pos", "link_pos_deg", "motor_target")]
)
def test_a_geared_motor_is_counted_at_its_joint_by_the_sensor_on_the_link(names, tmp_path, capsys) -> None:
    motor, link, command = names
    gear, columns = -81.0, table(0)
    angle = DEGREE if link.endswith("deg") else 1.0
    logged = {
        "time": columns["time"],
        command: columns["a.command"] * (gear * angle if command.startswith("motor") else 1.0),
        motor: columns["a.position"] * gear * angle,
        link: (columns["a.position"] + 0.1) * angle,
        "motor_torque": columns["a.torque"] / gear,
        "tau_ff": np.full(300, 0.2),
    }
    recording = imported(tmp_path, {"log.csv": logged}, ONE_JOINT)
    trial = recording.trials[0]
    assert "-81 turns a turn of its link" in capsys.readouterr().out
    for own, read in (("command", trial.command), ("position", trial.position), ("torque", trial.torque)):
        assert read is not None
        assert read[:, 0] == pytest.approx(columns[f"a.{own}"], abs=1e-5)
    assert trial.link_position is not None
    assert trial.feedforward is not None
    assert trial.link_position[:, 0] == pytest.approx(columns["a.position"] + 0.1, abs=1e-5)
    assert trial.feedforward[:, 0] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("names", "changes"), [(("goal_ticks", "present_ticks"), {}), (("goal", "pos"), {"angle_unit": 4096})]
)
def test_ticks_of_an_encoder_are_angles_about_the_middle_of_its_turn(names, changes, tmp_path) -> None:
    columns = table(0)
    ticks = [np.round(columns[f"a.{one}"] / (2 * np.pi) * 4096) + 2048 for one in ("command", "position")]
    logged = {"time": columns["time"], **dict(zip(names, ticks, strict=True))}
    trial = imported(tmp_path, {"log.csv": logged}, ONE_JOINT, **changes).trials[0]
    assert trial.position[:, 0] == pytest.approx(columns["a.position"], abs=8e-4)
    assert trial.command[:, 0] == pytest.approx(columns["a.command"], abs=8e-4)


def test_ticks_of_a_geared_motor_are_counted_at_its_joint_and_a_command_in_degrees_stays_one(tmp_path: Path) -> None:
    columns = table(0)
    logged = {
        "time": columns["time"],
        "goal_deg": columns["a.command"] * DEGREE,
        "motor_pos_ticks": np.round(columns["a.position"] * 50.0 / (2 * np.pi) * 1024),
        "link_pos_rad": columns["a.position"],
    }
    names = {
        "time": "time",
        "a": {"command": "goal_deg", "position": "motor_pos_ticks", "link_position": "link_pos_rad"},
    }
    with pytest.raises(InputError, match=r"'motor_pos_ticks': ticks from -?\d+ to \d+; of how many is a turn\?"):
        imported(tmp_path, {"log.csv": logged}, ONE_JOINT, columns=names)
    logged["motor_pos_ticks"] *= 0.2  # a gear of 10
    logged["motor_pos_ticks"] = np.round(logged["motor_pos_ticks"]) + 2048
    trial = imported(tmp_path, {"log.csv": logged}, ONE_JOINT, columns=names).trials[0]
    moved = trial.position[:, 0] - trial.position[0, 0]
    assert moved == pytest.approx(columns["a.position"] - columns["a.position"][0], abs=2e-3)
    assert trial.command[:, 0] == pytest.approx(columns["a.command"], abs=1e-6)


@pytest.mark.parametrize(("first", "middle", "zero"), [(2048, 300, 2048), (0, 300, 0), (40, 300, 0), (3000, 300, 2048)])
def test_the_zero_of_ticks_is_where_the_joint_keeps_its_limits_and_else_the_nearer(first, middle, zero) -> None:
    values = np.array([first - min(first, middle), first, first + middle], dtype=float)
    for limit in (2.0, np.inf) if first in (0, 2048) else (np.inf,):
        unit = position_unit(4096, "Present Position", values, RigJoint("a", -limit, limit, None))
        assert unit.zero == zero


def test_a_gear_that_is_known_is_said_and_a_feedforward_is_found_by_its_name(tmp_path: Path) -> None:
    columns = table(0)
    logged = {
        "time": columns["time"],
        "a.command": columns["a.command"],
        "a_motor_angle": columns["a.position"] * 50.5,
        "a_link_angle": columns["a.position"],
        "a.feedforward": np.full(300, 0.2),
    }
    trial = imported(tmp_path, {"log.csv": logged}, ONE_JOINT, gear=50.0).trials[0]
    assert trial.position[:, 0] == pytest.approx(columns["a.position"] * 1.01, abs=1e-5)
    assert trial.feedforward is not None


def test_a_load_is_no_second_encoder(tmp_path: Path) -> None:
    columns = table(0)
    logged = {"time": columns["time"], "Goal Position": columns["a.command"], "Present Position": columns["a.position"]}
    trial = imported(tmp_path, {"log.csv": logged | {"Present Load": columns["a.torque"]}}, ONE_JOINT).trials[0]
    assert trial.link_position is None


@pytest.mark.parametrize("rate", [250.0, 1000.0, 83.371])
def test_a_clock_that_counts_from_1970_moves_no_command_to_another_row(rate: float, tmp_path: Path) -> None:
    columns = table(0, samples=20_000)
    stamps = 1.7723664e9 + np.arange(20_000) / rate
    lines = zip(stamps, columns["a.command"], columns["a.position"], strict=True)
    text = "time,a_cmd,a_pos\n" + "\n".join(f"{t:.6f},{q_d:.6f},{q:.6f}" for t, q_d, q in lines)
    recording = imported(tmp_path, {"log.csv": text}, ONE_JOINT)
    assert recording.rate == pytest.approx(rate, rel=1e-8)
    # a row feels the mean of its own command and the one before, so commands are looked at where they are read
    assert recording.trials[0].command[:, 0] == pytest.approx(columns["a.command"], abs=1e-6)


def test_the_rate_of_irregular_rows_is_the_medians() -> None:
    steps = np.tile([0.01, 0.01, 0.013, 0.01, 0.2], 30)
    assert rate_of(np.cumsum(steps), 3, "log") == 100.0


def test_a_header_may_be_a_comment_and_a_decimal_comma_may_come_late(tmp_path: Path) -> None:
    rows = np.array([[0.0, 0.0], [1.0, 0.5]])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="time,angle", fmt="%.1f")
    (tmp_path / "b.csv").write_text("time;angle\n0;0\n1;0,5\n")
    for name in ("a.csv", "b.csv"):
        read = read_table(tmp_path / name)
        assert np.stack([read["time"], read["angle"]], axis=1).tolist() == rows.tolist()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time a_cmd a_pos\n0 0 0\n", "separated by blanks"),
        ("0.0,0.0,0.0\n0.1,0.0,0.0\n", "its first line has numbers, '0.0,0.0,0.0'; write the columns' names above"),
        ("time,a_cmd,a_pos\n0.0,0,0\n0.01,0,ERR\n0.02,0,0\n", "'a_pos', row 1: expected a number, not 'ERR'"),
    ],
)
def test_what_is_no_table_of_numbers_is_named(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        imported(tmp_path, {"log.csv": text}, ONE_JOINT)


@pytest.mark.parametrize("ticks", [3, 0])
def test_ticks_that_no_encoder_has_are_refused(ticks: int, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=rf"source.angle_unit={ticks}: a turn has more ticks"):
        imported(tmp_path, {"log.csv": log(NUMBERED)}, angle_unit=ticks)


def test_a_command_and_a_position_in_ticks_have_one_zero() -> None:
    joint = RigJoint("a", -1.0, 1.0, None)
    within, beyond = np.array([300.0, 310.0]), np.array([300.0, 2100.0])
    units = [position_unit(None, f"{name}_ticks", one, joint) for name, one in (("goal", within), ("pos", beyond))]
    assert [one.zero for one in units] == [0.0, 2048.0]
    assert [one.zero for one in same_unit(*units, ratio=180.0)] == [2048.0, 2048.0]


@pytest.mark.parametrize("gear", [0.0, 50.0])
def test_a_gear_without_a_use_is_refused(gear: float, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=rf"source\.gear={gear:g}: give turns, not 0"):
        imported(tmp_path, {"log.csv": log(NUMBERED)}, gear=gear)
