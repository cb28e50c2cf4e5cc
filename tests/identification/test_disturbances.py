"""A push stands out where the same command, played again, shows nothing of it; commands that were logged late."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import catalogue, find_effect
from tactile_cube.identification.disturbances import Disturbance, disturbances, in_time, undisturbed
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.simulator import free_run
from tests.identification.rigs_of_any_size import EFFECTS, SAMPLES, STEP, Size, simulated
from tests.measurement.small_rig import write

NOISE = np.full(2, 1e-4)
START, END = 3.1, 3.6  # [s]
EVERY = tuple(catalogue().values())  # one kernel is compiled for all tests


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Three runs of one command of 6 s by the model as stated, each with noise of its own."""
    whole = read_recording(write(tmp_path_factory.mktemp("plain")))
    time = np.arange(600) / 100.0
    command = np.stack([0.3 * np.sin(2.0 * np.pi * 0.8 * time), 0.4 * np.sin(2.0 * np.pi * 0.5 * time)], axis=1)
    longer = replace(whole.trials[0], time=time, command=command, position=command, torque=None, valid=time >= 0.0)
    (result,) = free_run(whole.with_trials([longer]), nominal_model(whole), step=5e-4)
    rng = np.random.default_rng(0)
    runs = [result.position + NOISE * rng.normal(size=(600, 2)) for _ in range(3)]
    return whole.with_trials([replace(longer, name=f"run_{k}", position=one) for k, one in enumerate(runs)])


def pushed(plain: Recording, *numbers: int) -> Recording:
    """The same with joint b moved by 50 mrad for half a second in some of the runs."""
    time = plain.trials[0].time
    bump = 0.05 * np.sin(np.pi * np.clip((time - START) / (END - START), 0.0, 1.0)) ** 2
    trials = list(plain.trials)
    for number in numbers:
        position = trials[number].position + bump[:, None] * np.array([0.0, 1.0])
        trials[number] = replace(trials[number], position=position)
    return plain.with_trials(trials)


def found(recording: Recording) -> list[Disturbance]:
    search = Search(recording, recording, NOISE, EVERY, lambda line: None)
    return disturbances(search, recording, nominal_model(recording))


def test_a_push_is_found_with_its_trial_joint_and_time(plain: Recording) -> None:
    (one,) = found(pushed(plain, 1))
    assert (one.trial, one.joint, one.repeats) == ("run_1", "b", 2)
    assert START - 1.0 < one.start < START < END < one.end < END + 1.0
    assert one.error > 5.0 * one.usual


def test_what_other_runs_of_the_command_show_too_is_no_push(plain: Recording) -> None:
    assert found(plain) == []
    assert found(pushed(plain, 0, 1, 2)) == []


def test_a_push_is_found_beside_a_model_that_fails_in_all_runs(plain: Recording) -> None:
    wave = 0.02 * np.sin(2.0 * np.pi * 1.3 * plain.trials[0].time)
    pushed_once = pushed(plain, 1)
    wrong = [replace(one, position=one.position + wave[:, None]) for one in pushed_once.trials]
    (one,) = found(pushed_once.with_trials(wrong))
    assert (one.trial, one.joint) == ("run_1", "b")
    assert START - 1.0 < one.start < START < END < one.end < END + 1.0
    assert one.error < 5.0 * one.usual


def test_two_pushes_at_the_same_time_are_found_where_a_third_run_shows_none(plain: Recording) -> None:
    assert [one.trial for one in found(pushed(plain, 0, 2))] == ["run_0", "run_2"]


def test_what_nothing_repeats_is_found_and_said_to_be_alone(plain: Recording) -> None:
    only = plain.with_trials(pushed(plain, 0).trials[:1])
    assert [(one.trial, one.repeats) for one in found(only)] == [("run_0", 0)]


def test_a_push_counts_in_no_error_once_it_is_left_out(plain: Recording) -> None:
    recording = pushed(plain, 1)
    left = undisturbed(recording, found(recording))
    out = ~left.trials[1].valid
    time = recording.trials[1].time
    assert out[(time >= START) & (time < END)].all()
    assert 0.0 < out.mean() < 0.4
    assert left.trials[0].valid.all()
    assert left.trials[2].valid.all()
    assert found(left) == []


LATE = 3  # rows


def test_commands_logged_late_are_taken_earlier_and_said(tmp_path: Path) -> None:
    clean = simulated(tmp_path, Size(), find_effect("viscous_friction"), {"damping": 0.01})
    said: list[str] = []
    assert in_time(clean, EFFECTS, said.append) is clean
    assert not said

    logged = [np.concatenate([np.repeat(t.command[:1], LATE, axis=0), t.command[:-LATE]]) for t in clean.trials]
    late = clean.with_trials([replace(t, command=c) for t, c in zip(clean.trials, logged, strict=True)])
    found = in_time(late, EFFECTS, said.append)
    for trial, true in zip(found.trials, clean.trials, strict=True):
        assert np.array_equal(trial.command[: SAMPLES - LATE], true.command[: SAMPLES - LATE])
        assert np.flatnonzero(~trial.valid).tolist() == list(range(SAMPLES - LATE, SAMPLES))
    assert f"commands_late: {LATE}" in said[0]
    assert f"{LATE} rows ({1e3 * LATE * STEP:.3g} ms) before its commands" in said[0]


@pytest.mark.parametrize(
    ("effect", "values"), [("integral_action", {"ki": 75.0, "lag": 0.06}), ("elasticity", {"compliance": 0.03})]
)
def test_what_seems_to_know_its_commands_early_is_told_from_commands_that_were_logged_late(
    effect: str, values: dict[str, float], tmp_path: Path
) -> None:
    recording = simulated(tmp_path, Size(), find_effect(effect), values)
    assert in_time(recording, EFFECTS, lambda line: None) is recording, "though nobody asks for that effect"


def test_what_was_found_is_written_once_and_read_by_every_command(tmp_path: Path) -> None:
    clean = simulated(tmp_path, Size(), find_effect("viscous_friction"), {"damping": 0.01})
    file = tmp_path / "recording.yaml"
    file.write_text(file.read_text() + f"sensors: {{commands_late: {LATE}}}\n")
    for trial, logged in zip(read_recording(tmp_path).trials, clean.trials, strict=True):
        assert np.array_equal(trial.command[:-LATE], logged.command[LATE:])
        assert np.flatnonzero(~trial.valid).tolist() == list(range(SAMPLES - LATE, SAMPLES))
        assert np.array_equal(trial.position, logged.position)
