from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.measurement.recordings.consistency import swap_warning
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tests.measurement.small_rig import setting, write


@pytest.fixture
def held(tmp_path: Path) -> Recording:
    """Two trials at rest in many postures, the torques those of the links' weight."""
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
