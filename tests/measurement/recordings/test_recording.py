from dataclasses import replace
from pathlib import Path

import numpy as np
import polars
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings import columns as outliers
from tactile_cube.measurement.recordings.consistency import swap_warning
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tests.measurement.small_rig import URDF, setting, table, write

SHARED = Path(__file__).parents[4] / "shared" / "recordings"


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_csv_and_npz_are_read_like_parquet(tmp_path: Path, ending: str) -> None:
    write(tmp_path, setting({"trials.0.file": f"first.{ending}"}))
    columns = table(0)
    if ending == "csv":
        polars.DataFrame(columns).write_csv(tmp_path / "first.csv")
    else:
        np.savez(tmp_path / "first.npz", **columns)
    read = read_recording(tmp_path)
    assert np.allclose(read.trials[0].position[:, 0], columns["a.position"], atol=1e-12)


def test_samples_on_the_grid_are_taken_bit_for_bit(tmp_path: Path) -> None:
    late = write(tmp_path, spoil=lambda columns: columns.update(time=columns["time"] + 1234.5))
    trial = read_recording(late).trials[0]
    assert np.array_equal(trial.position[:, 1], table(0)["b.position"])
    assert trial.time[0] == 0.0


def test_gains_may_be_given_per_joint_by_name_or_for_a_trial(tmp_path: Path) -> None:
    gains = {"controller.kp": [3.0, 4.0], "controller.kd": {"b": 0.3, "a": 0.2}, "trials.1.controller": {"kp": 5.0}}
    recording = read_recording(write(tmp_path, setting(gains)))
    assert recording.gains.kp.tolist() == recording.trials[0].gains.kp.tolist() == [3.0, 4.0]
    assert recording.trials[1].gains.kp.tolist() == [5.0, 5.0], "a trial's own"
    assert recording.trials[1].gains.kd.tolist() == [0.2, 0.3]


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
    def wide(columns: dict) -> None:
        for key in ("a.command", "a.position"):
            columns[key] += 3.0

    def wrapped(columns: dict) -> None:
        wide(columns)
        for key in ("a.command", "a.position"):
            columns[key] = (columns[key] + np.pi) % (2.0 * np.pi) - np.pi

    urdf = URDF.replace('lower="-0.5" upper="0.5"', 'lower="-6" upper="6"')
    true, found = (read_recording(write(tmp_path / n, spoil=s, urdf=urdf)) for n, s in (("w", wide), ("b", wrapped)))
    assert not any("whole turn" in line for line in true.warnings)
    assert np.allclose(found.trials[0].position, true.trials[0].position, atol=1e-12)
    assert np.allclose(found.trials[0].command, true.trials[0].command, atol=1e-12)
    assert sum("whole turn" in line and "a." in line for line in found.warnings) == 2


def test_a_command_that_scatters_beside_a_smooth_position_may_be_the_position(tmp_path: Path) -> None:
    def exchanged(columns: dict) -> None:
        columns["a.command"], columns["a.position"] = columns["a.position"], columns["a.command"]

    (line,) = [one for one in read_recording(write(tmp_path, spoil=exchanged)).warnings if "exchanged" in one]
    assert "'a.command' scatters" in line


ROWS, SIZE = (40, 41, 170), 0.05


def spoil(columns: dict[str, np.ndarray]) -> None:
    columns["a.position"][list(ROWS)] += np.array([SIZE, -SIZE, SIZE])


def test_single_readings_that_are_nonsense_are_bridged_said_and_count_in_no_error(tmp_path: Path) -> None:
    clean = read_recording(write(tmp_path / "clean"))
    spoiled = read_recording(write(tmp_path / "spoiled", spoil=spoil))
    trial = spoiled.trials[0]
    assert np.flatnonzero(~trial.valid).tolist() == list(ROWS)
    assert np.abs(trial.position - clean.trials[0].position).max() < 0.15 * SIZE
    (line,) = [one for one in spoiled.warnings if "single readings" in one][:1]
    assert "a.position" in line
    assert f"first in row {ROWS[0]}" in line


def test_steps_and_quick_turns_of_the_motion_are_no_outliers(tmp_path: Path) -> None:
    def jerky(columns: dict[str, np.ndarray]) -> None:
        time = columns["time"]
        columns["a.position"][:] = 0.3 * np.sign(np.sin(8.0 * time)) + 0.1 * np.abs(np.sin(30.0 * time))

    assert read_recording(write(tmp_path, spoil=jerky)).trials[0].valid.all()


def test_readings_too_many_to_search_are_no_single_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outliers, "MANY", 2)
    assert read_recording(write(tmp_path, spoil=spoil)).trials[0].valid.all()


EXCLUDE = "trials.0.exclude"


def test_what_is_left_of_a_trial_becomes_trials_that_start_at_zero(tmp_path: Path) -> None:
    trials = read_recording(write(tmp_path, setting({EXCLUDE: [[1.0, 1.5]]}))).trials
    assert [trial.name for trial in trials] == ["first_0", "first_1", "second"]
    assert [len(trial.time) for trial in trials] == [100, 150, 300]
    assert trials[1].time[0] == 0.0
    assert np.allclose(trials[1].position[:, 0], table()["a.position"][150:], atol=1e-6)
    assert np.allclose(trials[1].command[:, 1], table()["b.command"][150:], atol=1e-6)


def test_rests_that_are_too_short_are_dropped(tmp_path: Path) -> None:
    trials = read_recording(write(tmp_path, setting({EXCLUDE: [[0.1, 2.9]]}))).trials
    assert [trial.name for trial in trials] == ["second"]


@pytest.mark.parametrize(
    ("excluded", "said"),
    [
        ({EXCLUDE: [[2.0, 1.0]]}, r"key 'trials\.0\.exclude': received \[2, 1\]"),
        ({EXCLUDE: [[0.0, 9.0]], "trials.1.exclude": [[0.0, 9.0]]}, "leaves nothing"),
    ],
)
def test_a_senseless_exclusion_is_refused(excluded: dict[str, object], said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        read_recording(write(tmp_path, setting(excluded)))


MIMIC = URDF.replace(
    "</robot>",
    """<link name="tip"/>
<joint name="c" type="revolute"><parent link="lower"/><child link="tip"/><axis xyz="1 0 0"/><mimic joint="a"/>
<limit lower="-1" upper="1" effort="1" velocity="10"/></joint></robot>""",
)


@pytest.mark.parametrize(("leader", "said"), [(None, False), ("a", False), ("b", True)])
def test_another_leader_than_the_urdfs_is_warned_of(leader: str | None, said: bool, tmp_path: Path) -> None:
    coupled = {"coupled": {"c": {"joint": leader}} if leader else {}}
    warnings = read_recording(write(tmp_path, setting(coupled), urdf=MIMIC)).warnings
    line = "key 'coupled': the URDF lets 'c' mimic 'a', recording.yaml says b"
    assert any(warning.endswith(line) for warning in warnings) == said


@pytest.fixture
def held(tmp_path: Path) -> Recording:
    """Two trials at rest in many configurations, the torques those of the links' weight."""
    recording = read_recording(write(tmp_path, setting({"gravity": [6.0, 0.0, -7.8]})))
    tree, trials = recording.rigid_body(), []
    for trial in recording.trials:
        position = np.repeat(np.random.default_rng(0).uniform(-0.4, 0.4, (6, 2)), 50, axis=0)
        weight = np.stack([tree.equations(q, np.zeros(2), recording.gravity)[1] for q in position])
        trials.append(replace(trial, position=position, torque=weight))
    return recording.with_trials(trials)


def test_torques_that_hold_the_links_up_are_no_warning(held: Recording) -> None:
    assert swap_warning(held) == []


def test_joints_exchanged_in_every_column_are_noticed_by_the_weight(held: Recording) -> None:
    wrong = [replace(t, position=t.position[:, ::-1], torque=t.torque[:, ::-1]) for t in held.trials]
    (warning,) = swap_warning(held.with_trials(wrong))
    assert "'a.torque' and 'b.torque'" in warning
    assert "swapped" in warning


def test_without_torque_nothing_is_said(held: Recording) -> None:
    assert swap_warning(held.with_trials([replace(t, torque=None) for t in held.trials])) == []
