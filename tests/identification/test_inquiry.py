"""What leaves much is asked once more without what follows no model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest

from tactile_cube.identification import inquiry
from tactile_cube.identification.disturbances import Disturbance
from tactile_cube.identification.inquiry import ALL, beside_disturbances

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
