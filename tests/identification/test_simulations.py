"""What a decision asks is simulated, once each."""

from types import SimpleNamespace

import numpy as np
import pytest

from tactile_cube.identification import verdict as asked
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.verdict import Simulations, Unexplained
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
    monkeypatch.setattr(asked, "Problem", lambda *_: None)
    search = SimpleNamespace(shooting=None, all_windows=None, criteria=STANDARD, validation=Judges(off), held_out=None)
    floor = SimpleNamespace(source=source, overall=2e-3)
    return Simulations(search, explanation("backlash", 9.0), floor, "fast", 0.002)  # type: ignore[arg-type]


@pytest.mark.parametrize(("off", "alike"), [(0.0, True), (0.09, True), (0.3, False)])
def test_laws_that_differ_by_a_part_of_the_noise_are_one(
    monkeypatch: pytest.MonkeyPatch, off: float, alike: bool
) -> None:
    ask = simulations(monkeypatch, off=off)
    assert ask.alike(explanation("coulomb_friction", 1.0), explanation("presliding_friction", 1.0)) is alike


@pytest.mark.parametrize(
    ("source", "left", "answer"), [("repeats", 1e-3, True), ("repeats", 3e-3, False), ("guess", 1e-3, False)]
)
def test_a_free_run_is_compared_with_repeats_once(
    monkeypatch: pytest.MonkeyPatch, source: str, left: float, answer: bool
) -> None:
    ask, runs = simulations(monkeypatch, source), []

    def error(held_out: object, simulated: object) -> object:
        runs.append(simulated)
        return SimpleNamespace(overall=left)

    monkeypatch.setattr(ask, "final", lambda one: SimpleNamespace(model=one.judgement.model))
    monkeypatch.setattr(asked, "free_run", lambda *_: "run")
    monkeypatch.setattr(asked, "free_run_error", error)
    one = explanation("coulomb_friction", 1.0)
    assert ask.as_repeats(one) is ask.as_repeats(one) is answer
    assert runs == (["run"] if source == "repeats" else [])


@pytest.mark.parametrize(("left", "answer"), [((), False), ((0.1, 0.0), False), ((0.0, 0.45), True)])
def test_what_is_left_follows_the_signals_where_a_black_box_explains_more_than_chance(
    monkeypatch: pytest.MonkeyPatch, left: tuple[float, ...], answer: bool
) -> None:
    ask = simulations(monkeypatch)
    monkeypatch.setattr(ask, "unexplained", lambda one: [Unexplained("q1", [], share) for share in left])
    assert ask.follows_signals(explanation("backlash", 2.0)) is answer
