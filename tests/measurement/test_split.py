from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.split import held_out_split
from tests.measurement.small_rig import write


def test_whole_initialisations_are_held_out(tmp_path: Path) -> None:
    fit, held = held_out_split(read_recording(write(tmp_path)))
    assert {t.initialisation for t in fit.trials}.isdisjoint(t.initialisation for t in held.trials)
    assert len(fit.trials) == len(held.trials) == 1


def test_without_initialisations_every_kind_stays_in_the_fit(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        for entry in data["trials"]:
            entry["initialisation"] = 0

    fit, held = held_out_split(read_recording(write(tmp_path, change)))
    assert {t.kind for t in fit.trials} == {"sines"}
    assert len(held.trials) == 1


def test_where_nothing_was_repeated_some_kinds_are_held_out(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["trials"] = [{"file": "first.parquet", "initialisation": 0, "kind": f"log{k}"} for k in range(6)]

    fit, held = held_out_split(read_recording(write(tmp_path, change)))
    assert (len(fit.trials), len(held.trials)) == (4, 2)
    assert {t.kind for t in fit.trials}.isdisjoint(t.kind for t in held.trials)


def test_a_single_trial_cannot_be_split(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["trials"] = data["trials"][:1]

    with pytest.raises(InputError, match=r"1 trial in all.*source\.length=SECONDS"):
        held_out_split(read_recording(write(tmp_path, change)))
