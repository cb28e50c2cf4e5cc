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
    """Searches in segments of 50 and more samples, what each answers, and what the answers leave."""

    def __init__(
        self,
        kinds: tuple[str, str],
        left: tuple[float, float] = (1.0, 1.0),
        bases: tuple[float, float] = (9.0, 9.0),
        rows: int = 200,
        repeats: bool = False,
    ) -> None:
        self.run: list[int] = []
        self.levels: tuple[object, ...] = ((),)
        self.kinds, self.left, self.bases, self.rows, self.repeats = kinds, left, bases, rows, repeats

    def search_in(self, longer: int) -> SimpleNamespace:
        rows, error = (50, self.bases[0]) if longer == 1 else (self.rows, self.bases[1])
        return SimpleNamespace(rows=rows, criteria=STANDARD, fit_base=lambda: SimpleNamespace(largest_error=error))

    def answered(self, search: SimpleNamespace) -> object:
        place = len(self.run)
        self.run.append(search.rows)
        error = self.bases[place]
        findings = SimpleNamespace(base=SimpleNamespace(largest_error=error, error=error), levels=self.levels)
        simulations = SimpleNamespace(as_repeats=lambda one: self.repeats)
        verdict = SimpleNamespace(kind=self.kinds[place], chosen=SimpleNamespace(largest_error=self.left[place]))
        return diagnosis.Answer(search, findings, simulations, verdict)  # type: ignore[arg-type]

    def rows_taken(self) -> int:
        return diagnosis.asked(self.search_in, self.answered, lambda line: None).search.rows  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kinds", "left", "taken"),
    [
        (("partly_explained", "missing_effect"), (5.0, 1.0), 200),
        (("unknown_effect", "partly_explained"), (5.0, 3.0), 50),
        (("partly_explained", "unknown_effect"), (5.0, 5.0), 50),
        (("unknown_effect", "unknown_effect"), (5.0, 5.0), 50),
        (("ambiguous", "missing_effect"), (1.0, 1.0), 200),
        (("ambiguous", "ambiguous"), (1.0, 1.0), 50),
        (("missing_effect", "missing_effect"), (1.8, 1.0), 200),
        (("missing_effect", "ambiguous"), (1.8, 1.0), 50),
    ],
    ids=["all", "a part", "less", "the same", "one of several", "still several", "and little is left", "several"],
)
def test_longer_segments_answer_where_only_they_name_all(
    kinds: tuple[str, str], left: tuple[float, float], taken: int
) -> None:
    asked = Asked(kinds, left)
    assert asked.rows_taken() == taken
    assert asked.run == [50, 200]


@pytest.mark.parametrize(
    ("kind", "rows"), [("missing_effect", 200), ("unknown_effect", 50)], ids=["nothing is left", "none are longer"]
)
def test_longer_segments_are_not_always_asked(kind: str, rows: int) -> None:
    asked = Asked((kind, "ambiguous"), rows=rows)
    assert asked.rows_taken() == 50
    assert asked.run == [50]


@pytest.mark.parametrize(
    ("bases", "repeats", "taken"),
    [((1.0, 6.0), False, 200), ((1.0, 1.2), False, 50), ((1.0, 6.0), True, 50)],
    ids=["slow effect", "nothing there either", "as the machine repeats itself"],
)
def test_what_short_segments_hide_is_searched_in_longer_ones(
    bases: tuple[float, float], repeats: bool, taken: int
) -> None:
    asked = Asked(("adequate", "missing_effect"), bases=bases, repeats=repeats)
    assert asked.rows_taken() == taken
    assert asked.run[1:] == ([200] if taken == 200 else [])


@pytest.mark.parametrize(("error", "searches"), [(2.5, 2), (9.0, 1)])
def test_where_nothing_was_found_longer_segments_are_searched_unless_short_ones_show_plenty(
    error: float, searches: int
) -> None:
    asked = Asked(("unknown_effect", "unknown_effect"), (error, error), bases=(error, error))
    asked.levels = ()
    assert asked.rows_taken() == 50
    assert asked.run == [50, 200][:searches]
