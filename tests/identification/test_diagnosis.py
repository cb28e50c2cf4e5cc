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


class Asked:
    """Searches in segments of 50 and more samples, and what each of them answers."""

    def __init__(
        self, kinds: tuple[str, str], bases: tuple[float, float] = (9.0, 9.0), rows: int = 200, repeats: bool = False
    ) -> None:
        self.run: list[tuple[int, object]] = []
        self.levels: tuple[object, ...] = ((),)
        self.kinds, self.bases, self.rows, self.repeats = kinds, bases, rows, repeats

    def search_in(self, longer: int) -> SimpleNamespace:
        rows, error = (50, self.bases[0]) if longer == 1 else (self.rows, self.bases[1])
        return SimpleNamespace(rows=rows, criteria=STANDARD, fit_base=lambda: SimpleNamespace(largest_error=error))

    def answered(self, search: SimpleNamespace, before: object = None) -> object:
        place = len(self.run)
        self.run.append((search.rows, before))
        error = self.bases[place]
        findings = SimpleNamespace(base=SimpleNamespace(largest_error=error, error=error), levels=self.levels)
        simulations = SimpleNamespace(as_repeats=lambda one: self.repeats)
        return diagnosis.Answer(search, findings, simulations, SimpleNamespace(kind=self.kinds[place]))  # type: ignore[arg-type]

    def rows_taken(self) -> int:
        return diagnosis.asked(self.search_in, self.answered, lambda line: None).search.rows  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kinds", "rows", "taken"),
    [
        (("partly_explained", "missing_effect"), 200, 200),
        (("unknown_effect", "partly_explained"), 200, 200),
        (("partly_explained", "unknown_effect"), 200, 50),
        (("unknown_effect", "unknown_effect"), 200, 50),
        (("unknown_effect", "missing_effect"), 50, 50),
        (("missing_effect", "ambiguous"), 200, 50),
    ],
    ids=["all of it", "a part", "less", "the same", "no longer segments", "nothing left to ask"],
)
def test_what_leaves_much_is_judged_once_more_in_longer_segments(kinds: tuple[str, str], rows: int, taken: int) -> None:
    asked = Asked(kinds, rows=rows)
    assert asked.rows_taken() == taken
    again = [before for rows, before in asked.run if rows == 200]
    assert all(again), "what the first search found is what the second one judges"
    assert len(again) == (0 if rows == 50 or kinds[0] == "missing_effect" else 1)


@pytest.mark.parametrize(
    ("bases", "repeats", "taken"),
    [((1.0, 6.0), False, 200), ((1.0, 1.2), False, 50), ((1.0, 6.0), True, 50)],
    ids=["slow effect", "nothing there either", "as the machine repeats itself"],
)
def test_what_short_segments_hide_is_searched_in_longer_ones(
    bases: tuple[float, float], repeats: bool, taken: int
) -> None:
    asked = Asked(("adequate", "missing_effect"), bases, repeats=repeats)
    assert asked.rows_taken() == taken
    assert asked.run[1:] == ([(200, None)] if taken == 200 else []), "a search of its own"


@pytest.mark.parametrize(("error", "searches"), [(2.5, 2), (9.0, 1)])
def test_where_nothing_was_found_longer_segments_are_searched_unless_short_ones_show_plenty(
    error: float, searches: int
) -> None:
    asked = Asked(("unknown_effect", "unknown_effect"), bases=(error, error))
    asked.levels = ()
    assert asked.rows_taken() == 50
    assert asked.run == [(50, None), (200, None)][:searches]
