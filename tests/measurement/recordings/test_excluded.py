from pathlib import Path

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tests.measurement.small_rig import table, write


def excluding(*intervals: list[float], every: bool = False) -> object:
    def change(data: dict) -> None:
        for entry in data["trials"] if every else data["trials"][:1]:
            entry["exclude"] = list(intervals)

    return change


def test_what_is_left_of_a_trial_becomes_trials_that_start_at_zero(tmp_path: Path) -> None:
    trials = read_recording(write(tmp_path, excluding([1.0, 1.5]))).trials  # type: ignore[arg-type]
    assert [trial.name for trial in trials] == ["first_0", "first_1", "second"]
    assert [len(trial.time) for trial in trials] == [100, 150, 300]
    assert trials[1].time[0] == 0.0
    assert np.allclose(trials[1].position[:, 0], table()["a.position"][150:], atol=1e-6)
    assert np.allclose(trials[1].command[:, 1], table()["b.command"][150:], atol=1e-6)


def test_rests_that_are_too_short_are_dropped(tmp_path: Path) -> None:
    trials = read_recording(write(tmp_path, excluding([0.1, 2.9]))).trials  # type: ignore[arg-type]
    assert [trial.name for trial in trials] == ["second"]


@pytest.mark.parametrize(
    ("interval", "every", "said"),
    [([2.0, 1.0], False, r"key 'trials\.0\.exclude': received \[2, 1\]"), ([0.0, 9.0], True, "leaves nothing")],
)
def test_a_senseless_exclusion_is_refused(interval: list[float], every: bool, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        read_recording(write(tmp_path, excluding(interval, every=every)))  # type: ignore[arg-type]
