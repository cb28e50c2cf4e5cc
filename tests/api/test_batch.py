"""Many calls at once."""

import json
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

import tactile_cube
from tactile_cube import InputError
from tactile_cube.api import diagnosis
from tests.api.test_measuring import RIG
from tests.measurement.small_rig import URDF


def refused(word: str) -> None:
    raise InputError(f"{word}: refused")


def one_after_the_other(work: Callable, over: Sequence, jobs: int) -> Iterator[tuple]:
    """In place of `each`."""
    yield from ((one, work(one)) for one in over)


def test_each_is_done_once_and_an_error_comes_through() -> None:
    numbers = [1.0, 4.0, 9.0, 16.0]
    assert sorted(diagnosis.each(math.sqrt, numbers, 2)) == [(x, math.sqrt(x)) for x in numbers]
    with pytest.raises(InputError, match="this one: refused"):
        list(diagnosis.each(refused, ["this one"]))


def test_recordings_are_diagnosed_into_folders_of_their_names_and_one_that_cannot_be_read_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "two.urdf").write_text(URDF)
    sound = tmp_path / "sound"
    rig = RIG | {"source.urdf": tmp_path / "two.urdf", "source.validation": False}
    tactile_cube.record(sound, source="rig", values=rig)
    monkeypatch.setattr(diagnosis, "each", one_after_the_other)
    anything_will_do = {"criteria.floor": 1e8, "criteria.adequate": 1e9}
    folders = [sound, tmp_path / "gone"]
    found = dict(tactile_cube.diagnose_each(folders, out=tmp_path / "out", values=anything_will_do))
    assert isinstance(found[tmp_path / "gone"], InputError)
    answer = found[sound]
    assert answer.data["verdict"] == "adequate", answer.text
    made = tmp_path / "out" / "sound"
    assert json.loads((made / "diagnosis.json").read_text())["verdict"] == "adequate"
    assert str(made / "model.yaml") in (made / "report.html").read_text(), "commands of the report name the file"
    assert tactile_cube.read_model(made / "model.yaml").joints == ["b"]


def test_recordings_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="give folders that differ in their last name"):
        list(tactile_cube.diagnose_each([tmp_path / "a" / "log", tmp_path / "b" / "log"], out=tmp_path))
