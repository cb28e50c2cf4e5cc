"""What a decision asks is simulated, once each; what leaves much is asked once more."""

from types import SimpleNamespace

import numpy as np
import pytest

from tactile_cube.identification import diagnosis
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.diagnosis import Simulations
from tactile_cube.identification.search.explanation import Explanation
from tests.identification.test_verdict import explanation


class Judges:
    """Held-out trials on which a second model is off by so many standard deviations of the noise."""

    weight = np.full((3, 5), 1e4)

    def __init__(self, off: float) -> None:
        self.off = off

    def predictions(self, models: list[object]) -> np.ndarray:
        return np.stack([np.zeros((3, 5)), np.full((3, 5), self.off / 1e4)])

    def limited(self, change: np.ndarray) -> np.ndarray:
        return change


def simulations(monkeypatch: pytest.MonkeyPatch, source: str = "repeats", off: float = 0.0) -> Simulations:
    monkeypatch.setattr(diagnosis, "Problem", lambda *_: None)
    search = SimpleNamespace(shooting=None, all_windows=None, criteria=STANDARD, validation=Judges(off))
    floor = SimpleNamespace(source=source, overall=2e-3)
    return Simulations(search, explanation("backlash", 9.0), floor, "fast", 0.002)  # type: ignore[arg-type]


@pytest.mark.parametrize(("off", "alike"), [(0.0, True), (0.09, True), (0.3, False)])
def test_laws_that_differ_by_a_part_of_the_noise_are_one(
    monkeypatch: pytest.MonkeyPatch, off: float, alike: bool
) -> None:
    ask = simulations(monkeypatch, off=off)
    assert ask.alike(explanation("coulomb_friction", 1.0), explanation("presliding_friction", 1.0)) is alike


@pytest.mark.parametrize(
    ("source", "error", "answer"), [("repeats", 1e-3, True), ("repeats", 3e-3, False), ("guess", 1e-3, False)]
)
def test_a_free_run_is_compared_with_repeats_once(
    monkeypatch: pytest.MonkeyPatch, source: str, error: float, answer: bool
) -> None:
    ask, runs = simulations(monkeypatch, source), []

    def run(one: Explanation) -> object:
        runs.append(one.label)
        return SimpleNamespace(overall=error)

    monkeypatch.setattr(ask, "simulated_error", run)
    one = explanation("coulomb_friction", 1.0)
    assert ask.as_repeats(one) is ask.as_repeats(one) is answer
    assert runs == ([one.label] if source == "repeats" else [])


@pytest.mark.parametrize(
    ("kinds", "rows", "taken"),
    [
        (("adequate", "unknown_effect"), 200, 0),
        (("partly_explained", "missing_effect"), 200, 1),
        (("unknown_effect", "partly_explained"), 200, 1),
        (("partly_explained", "unknown_effect"), 200, 0),
        (("unknown_effect", "unknown_effect"), 200, 0),
        (("unknown_effect", "missing_effect"), 50, 0),
    ],
    ids=["clear", "all of it", "a part", "less", "the same", "no longer segments"],
)
def test_what_leaves_much_is_asked_once_more_in_longer_segments(kinds: tuple[str, str], rows: int, taken: int) -> None:
    searches, run = {1: SimpleNamespace(rows=50), diagnosis.LONGER: SimpleNamespace(rows=rows)}, []

    def answered(search: SimpleNamespace, before: object = None) -> object:
        assert before == (f"found in {run[0].rows}" if run else None)
        run.append(search)
        return diagnosis.Answer(search, f"found in {search.rows}", None, SimpleNamespace(kind=kinds[len(run) - 1]))  # type: ignore[arg-type]

    answer = diagnosis.asked(searches.get, answered, lambda line: None)  # type: ignore[arg-type]
    assert answer.search is run[taken]
    assert len(run) == (1 if kinds[0] == "adequate" or rows == 50 else 2)
