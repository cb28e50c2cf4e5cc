from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.windows import Drive, _half_width, _states, between_steps, cut, steps_per_row
from tests.measurement.small_rig import write

NO_ROWS = np.zeros(0, dtype=np.int64)


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    return read_recording(write(tmp_path))


def test_every_sample_is_in_exactly_one_segment(recording: Recording) -> None:
    windows = cut(recording, np.array([2e-4, 2e-4]))
    counted = np.count_nonzero(windows.weight[..., 0])
    assert counted == sum(len(trial.time) for trial in recording.trials)


def test_dropped_samples_weigh_nothing(recording: Recording) -> None:
    trial = recording.trials[0]
    trial.valid[10:20] = False
    weight = cut(recording, np.array([2e-4, 2e-4]), [trial]).weight
    assert np.count_nonzero(weight[0, 10:20]) == 0
    assert np.count_nonzero(weight[0, :10]) == 20


def test_segments_start_where_the_joint_was_measured(recording: Recording) -> None:
    windows = cut(recording, np.array([2e-4, 2e-4]), recording.trials[:1])
    row = 3 * windows.segment
    phase = 2 * np.pi * 0.8 * (row / 100 - 0.02)
    assert windows.position[0, 3, 0] == pytest.approx(0.3 * np.sin(phase), abs=1e-3)
    assert windows.speed[0, 3, 0] == pytest.approx(0.3 * 2 * np.pi * 0.8 * np.cos(phase), abs=0.05)


def test_slow_recordings_are_simulated_in_finer_steps(recording: Recording) -> None:
    windows = cut(recording, np.array([2e-4, 2e-4]))
    assert steps_per_row(recording) == windows.substeps == 5
    rows = windows.history + windows.measured.shape[1]
    assert windows.commands.shape[1] == 5 * rows


def test_the_first_step_of_a_row_takes_the_mean_of_two_commands(recording: Recording) -> None:
    trial = recording.trials[0]
    windows = cut(recording, np.array([2e-4, 2e-4]), [trial])
    first = windows.history * windows.substeps
    assert windows.commands[0, first] == pytest.approx(0.5 * (trial.command[0] + trial.command[1]))
    assert windows.commands[0, first + 1] == pytest.approx(trial.command[1])


def test_taking_windows_keeps_rows_together(recording: Recording) -> None:
    windows = cut(recording, np.array([2e-4, 2e-4]))
    last = windows.take(np.array([len(windows) - 1]))
    assert last.trial.tolist() == [1]
    assert np.array_equal(last.measured[0], windows.measured[-1])


def test_a_later_window_wakes_the_memories_of_effects_before_its_samples_count(recording: Recording) -> None:
    windows = cut(recording, np.array([2e-4, 2e-4]), segment=10)
    later = windows.time > 0.0
    assert later.any()
    assert not windows.weight[later, :10].any()
    assert windows.weight[later, 10:11].all()


def test_a_start_in_the_middle_of_a_jerk_is_read_without_bias(recording: Recording) -> None:
    """3 rad/s reached and lost within 60 ms, sampled at 500 Hz, under a command with a kink."""
    time, row = np.arange(200) / 500.0, 88
    pulse = np.exp(-0.5 * ((time - time[100]) / 0.03) ** 2)
    link = np.repeat(np.cumsum(3.0 * pulse)[:, None] / 500.0, 2, axis=1)
    command = link + np.maximum(time - time[row], 0.0)[:, None]
    drive = Drive(*(np.full(2, value) for value in (4.0, 0.0, 1.0, 0.04)))
    motor = (link + 4.0 * 0.04 * command) / (1.0 + 4.0 * 0.04)
    trial = replace(recording.trials[0], time=time, position=motor)
    half = _half_width(trial.step, np.full(2, 1e-4), 0.02, time=1.0)
    assert half == 12, "this noise asks for no more"
    position, speed, _, spread = _states(trial, command, 0.0 * command, drive, NO_ROWS, np.array([row]), half)
    assert np.all(spread * 1e-4 < 0.02)
    assert position[0] == pytest.approx(motor[row])
    assert speed[0] == pytest.approx(3.0 * pulse[row], abs=0.06)


def stepped(recording: Recording, every: int) -> Trial:
    """A trial whose command jumps by 3 rad so often."""
    trial = recording.trials[0]
    command = np.where(np.arange(len(trial.time)) // every % 2 == 0, 0.0, 3.0)
    return replace(trial, command=np.repeat(command[:, None], 2, axis=1))


def test_a_segment_that_begins_just_after_a_step_of_the_command_weighs_nothing(recording: Recording) -> None:
    noise = np.array([2e-4, 2e-4])
    windows = cut(recording, noise, [stepped(recording, 27)], segment=10)
    counted = windows.weight[0, :80, 0].reshape(-1, 10).any(axis=1)  # sampled at 100 Hz, read before rows 27 and 54
    assert counted.tolist() == [True, True, True, False, True, True, False, True]
    gentle = recording.trials[0]
    assert cut(recording, noise, [gentle], segment=10).weight[0, :80].all()


def test_where_most_segments_begin_just_after_a_step_they_all_count(recording: Recording) -> None:
    windows = cut(recording, np.array([2e-4, 2e-4]), [stepped(recording, 10)], segment=10)
    assert windows.weight[0, :80].all()


def test_segments_do_not_begin_as_a_command_steps(recording: Recording) -> None:
    """Steps every 0.8 s; of segments of 0.4 s every second one would begin as the command steps."""
    trial = stepped(recording, round(0.8 / recording.step))
    usual = round(0.4 / recording.step)
    rows = between_steps([trial], usual)
    assert 0 < abs(rows - usual) <= 0.1 * usual
    late = (np.arange(0, len(trial.time), rows) * trial.step) % 0.8
    before = (np.arange(0, len(trial.time), usual) * trial.step) % 0.8
    assert np.count_nonzero(late < 0.1) < np.count_nonzero(before < 0.1)


def test_a_segment_is_as_long_as_usual_where_no_command_moves(recording: Recording) -> None:
    still = replace(recording.trials[0], command=0.0 * recording.trials[0].command)
    assert between_steps([still], 100) == 100


def test_the_impulse_of_a_step_asks_for_half_the_torque_there_is(recording: Recording) -> None:
    trial = stepped(recording, 12)
    windows = cut(recording, np.array([2e-4, 2e-4]), [trial])
    at = (windows.history + 11) * windows.substeps  # row 11 is read as the command of row 12 comes into force
    reach = np.array(trial.gains.torque_limit) / np.array(trial.gains.kp)
    assert (reach < 3.0).all()
    assert windows.commands[0, at] == pytest.approx(0.5 * reach)
    assert windows.commands[0, at + 1] == pytest.approx([3.0, 3.0])


def test_a_speed_is_read_before_a_step_and_not_across(recording: Recording) -> None:
    """At rest until the command steps, and fast at once."""
    time, row, half = np.arange(60) / 500.0, 30, 12
    link = np.repeat(np.maximum(time - time[row], 0.0)[:, None], 2, axis=1)
    drive = Drive(*(np.full(2, value) for value in (4.0, 0.0, 1.0, 0.0)))
    trial = replace(recording.trials[0], time=time, position=link)
    rest, moving = (
        _states(trial, link, 0.0 * link, drive, kinks, np.array([row]), half)[1] for kinks in (np.array([row]), NO_ROWS)
    )
    assert rest[0] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert moving[0, 0] > 0.3


def test_where_few_rows_leave_the_speed_too_noisy_more_are_taken() -> None:
    fast, noise = 0.1, np.array([2e-4])  # ten times as fast as a finger, sampled at 500 Hz
    assert _half_width(0.002, noise, np.inf, fast) == 2
    assert _half_width(0.002, noise, 0.01, fast) == 5
    assert _half_width(0.002, noise, 1e-6, fast) == 10, "half a segment at most"


def test_a_start_is_known_no_better_than_the_noise_lets_it(recording: Recording) -> None:
    rough, fine = (cut(recording, np.array([noise, noise])).start_noise for noise in (2e-4, 1e-4))
    assert rough.shape == (*cut(recording, np.array([2e-4, 2e-4])).position.shape[:2], 4)
    assert np.allclose(rough, 2.0 * fine)
    assert np.all(rough[..., :2] == 2e-4)
