"""What leaves much is asked once more, in longer segments or without what follows no model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import pytest

from tactile_cube.identification import diagnosis, inquiry
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.disturbances import Disturbance
from tactile_cube.identification.inquiry import ALL, beside_disturbances


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
        self.known: list[tuple[object, ...]] = []
        self.levels: tuple[object, ...] = ((),)
        self.kinds, self.left, self.bases, self.rows, self.repeats = kinds, left, bases, rows, repeats

    def search_in(self, longer: int) -> SimpleNamespace:
        rows, error = (50, self.bases[0]) if longer == 1 else (self.rows, self.bases[1])
        return SimpleNamespace(rows=rows, criteria=STANDARD, base=SimpleNamespace(largest_error=error))

    def answered(self, search: SimpleNamespace, known: tuple[object, ...]) -> object:
        place = len(self.run)
        self.run.append(search.rows)
        error = self.bases[place]
        findings = SimpleNamespace(base=SimpleNamespace(largest_error=error, error=error), levels=self.levels)
        simulations = SimpleNamespace(as_repeats=lambda one: self.repeats)
        chosen = SimpleNamespace(largest_error=self.left[place])
        verdict = SimpleNamespace(kind=self.kinds[place], chosen=chosen, rivals=("another",))
        self.known.append(known)
        return inquiry.Answer(search, findings, simulations, verdict)  # type: ignore[arg-type]

    def rows_taken(self) -> int:
        usual = self.answered(self.search_in(1), ())
        return inquiry.asked(usual, self.search_in, self.answered, lambda line: None).search.rows  # type: ignore[arg-type]


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
    assert [len(known) for known in asked.known] == [0, 2 if kinds[0] == "ambiguous" else 0], "only those are asked of"


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


PUSHED = Disturbance("pushed", 1.0, 2.0, "a", 50.0, 1.2, repeats=2)
ALONE = replace(PUSHED, trial="alone", repeats=0)


@dataclass(frozen=True)
class Pretended:
    """An inquiry whose recording is the set of the trials that still count; `says` is what each answers."""

    recording: frozenset[str]
    says: dict[frozenset[str], tuple[int, bool]]
    asked: list[frozenset[str]]

    @property
    def search(self) -> SimpleNamespace:
        return SimpleNamespace(base=SimpleNamespace(fit=SimpleNamespace(model="base")))

    @property
    def answer(self) -> SimpleNamespace:
        if self.recording not in self.asked:
            self.asked.append(self.recording)
        final = SimpleNamespace(final=lambda one: SimpleNamespace(model="chosen"))
        chosen = SimpleNamespace(chosen=None)
        return SimpleNamespace(search=self.search, says=self.says[self.recording], simulations=final, verdict=chosen)

    def say(self, line: str) -> None:
        pass


def inquired(
    monkeypatch: pytest.MonkeyPatch,
    seen: dict[str, tuple[Disturbance, ...]],
    says: dict[frozenset[str], tuple[int, bool]],
) -> tuple[inquiry.Inquired, list[frozenset[str]]]:
    """What is left out where the base model and the chosen one show these stretches, and what was searched for it."""
    trials = frozenset({"pushed", "alone", "clean"})
    monkeypatch.setattr(
        inquiry, "disturbances", lambda _, trials, model: [one for one in seen.get(model, ()) if one.trial in trials]
    )
    monkeypatch.setattr(inquiry, "undisturbed", lambda trials, found: trials - {one.trial for one in found})
    pretended = Pretended(trials, says, [])
    return beside_disturbances(pretended), pretended.asked  # type: ignore[arg-type]


EVERY, WITHOUT, WITHOUT_ALONE = (
    frozenset({"pushed", "alone", "clean"} - set(gone)) for gone in ((), ("pushed",), ("alone",))
)


def test_what_repeats_show_to_be_a_push_is_left_out_before_anything_is_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found, asked = inquired(monkeypatch, {"base": (PUSHED,)}, {WITHOUT: ALL})
    assert (found.inquiry.recording, found.left_out, found.suspected) == (WITHOUT, (PUSHED,), ())
    assert asked == [WITHOUT]


def test_a_push_that_only_the_answer_shows_is_left_out_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    found, asked = inquired(monkeypatch, {"chosen": (PUSHED, ALONE)}, {EVERY: ALL, WITHOUT: ALL})
    assert (found.left_out, asked) == ((PUSHED,), [EVERY, WITHOUT])


def test_what_was_played_once_is_left_out_only_where_that_names_all(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = {"base": (ALONE,), "chosen": (ALONE,)}
    found, _ = inquired(monkeypatch, seen, {EVERY: (0, False), WITHOUT_ALONE: ALL})
    assert (found.left_out, found.suspected) == ((ALONE,), ())
    found, _ = inquired(monkeypatch, seen, {EVERY: (0, False), WITHOUT_ALONE: (0, False)})
    assert (found.inquiry.recording, found.left_out, found.suspected) == (EVERY, (), (ALONE,))
    found, asked = inquired(monkeypatch, seen, {EVERY: ALL})
    assert (found.left_out, asked) == ((), [EVERY]), "an answer that names all is not asked again"


@dataclass(frozen=True)
class InAnySteps:
    """An inquiry that answers in any steps with the same error [sensor noise]."""

    recording: int
    error: float
    effects: tuple[()] = ()
    known: None = None
    known_answer: tuple[Any, ...] = ()
    finer: int = 1

    def say(self, line: str) -> None:
        """Take a line."""

    @property
    def first(self) -> Any:
        """What is found."""
        chosen = SimpleNamespace(error=self.error, effects=("law",))
        return SimpleNamespace(verdict=SimpleNamespace(chosen=chosen, rivals=()))


@pytest.mark.parametrize(("left", "steps"), [(1.1, 8), (4.0, 8), (9.0, 8), (400.0, 1)])
def test_an_answer_stands_in_steps_that_hide_nothing_beside_what_it_leaves(
    monkeypatch: pytest.MonkeyPatch, left: float, steps: int
) -> None:
    # a recording is the number of its steps: 8 where errors as small as the noise shall show, 1 where larger ones
    monkeypatch.setattr(diagnosis, "stated_error", lambda *args: 1000.0)
    monkeypatch.setattr(
        diagnosis, "resolved", lambda recording, effects, say, known, beside=1.0: 8 if beside <= 1.0 else 1
    )
    monkeypatch.setattr(diagnosis, "_steps", lambda recording: recording)
    asked = diagnosis.in_long_steps_first(InAnySteps(0, left))  # type: ignore[arg-type]
    assert asked.recording == steps
    assert len(asked.known_answer) == (steps == 8), "what long steps found is asked of first"
