"""What a decision asks is simulated, once each."""

from types import SimpleNamespace

import numpy as np
import pytest

from tactile_cube.identification import simulations as asked
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.simulations import Simulations
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
