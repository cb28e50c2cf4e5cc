from dataclasses import replace
from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.split import held_out_split, with_test_part
from tests.measurement.small_rig import setting, write


def test_whole_initialisations_are_held_out(tmp_path: Path) -> None:
    fit, held = held_out_split(read_recording(write(tmp_path)))
    assert {t.initialisation for t in fit.trials}.isdisjoint(t.initialisation for t in held.trials)
    assert len(fit.trials) == len(held.trials) == 1


def test_without_initialisations_every_kind_stays_in_the_fit(tmp_path: Path) -> None:
    fit, held = held_out_split(read_recording(write(tmp_path, setting({"trials.1.initialisation": 0}))))
    assert {t.kind for t in fit.trials} == {"sines"}
    assert len(held.trials) == 1


def test_where_nothing_was_repeated_some_kinds_are_held_out(tmp_path: Path) -> None:
    trials = [{"file": "first.parquet", "initialisation": 0, "kind": f"log{k}"} for k in range(6)]
    fit, held = held_out_split(read_recording(write(tmp_path, setting({"trials": trials}))))
    assert (len(fit.trials), len(held.trials)) == (4, 2)
    assert {t.kind for t in fit.trials}.isdisjoint(t.kind for t in held.trials)


def test_a_single_trial_cannot_be_split(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"1 trial in all.*source\.length=SECONDS"):
        held_out_split(read_recording(write(tmp_path, setting({"trials": [{"file": "first.parquet"}]}))))


def twelve(tmp_path: Path, initialisations: int) -> Recording:
    names = [{"initialisation": k % initialisations, "kind": f"log{k % 4}"} for k in range(12)]
    trials = [{"file": "first.parquet"} | one for one in names]
    read = read_recording(write(tmp_path, setting({"trials": trials})))
    return read.with_trials([replace(trial, name=f"t{k}") for k, trial in enumerate(read.trials)])


@pytest.mark.parametrize("initialisations", [1, 3])
def test_the_trials_that_test_are_neither_fitted_nor_chosen_by(tmp_path: Path, initialisations: int) -> None:
    whole = twelve(tmp_path, initialisations)
    fit, held = held_out_split(whole)
    less, tested = with_test_part(fit, 12)
    assert tested is not None
    assert len(tested.trials) == 2
    parts = [{trial.name for trial in part.trials} for part in (less, held, tested)]
    assert set().union(*parts) == {trial.name for trial in whole.trials}
    assert sum(len(part) for part in parts) == 12
    assert {t.kind for t in less.trials} == {t.kind for t in fit.trials}, "each kind stays in the fit"


def test_few_trials_are_all_needed_by_the_fit(tmp_path: Path) -> None:
    fit, _ = held_out_split(read_recording(write(tmp_path)))
    assert with_test_part(fit, 2) == (fit, None)
