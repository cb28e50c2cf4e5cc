from pathlib import Path

import numpy as np
import pytest
import yaml

from benchmarks.gait.gait_search import BOUNDS, search_gait, try_gait, write_gait
from tactile_cube.env import RotationEnv, Task, TimeStep
from tactile_cube.env.task import DROPPED, RUNNING, TIME_LIMIT
from tactile_cube.hand import DLR_HAND2, Gait
from tactile_cube.hand.gait import GaitRanges
from tactile_cube.training.ledger import Costs


class TurnsBySwing:
    """Turns the object by the way the first joint goes, and loses it on wide swings."""

    hand, task = DLR_HAND2, Task("full", episode_steps=30)

    def seed(self, seed: int, index: int = 0) -> None:
        pass

    def reset(self) -> TimeStep:
        self._theta, self._last = 0.0, None
        return self._moment(0, RUNNING)

    def step(self, action: np.ndarray) -> TimeStep:
        if self._last is not None:
            self._theta += float(np.abs(action - self._last).sum())
        self._last, step = action, self._step + 1
        return self._moment(step, TIME_LIMIT if step == 30 else RUNNING)

    def _moment(self, step: int, outcome: int) -> TimeStep:
        self._step = step
        return TimeStep(np.zeros(12), np.zeros(12), np.zeros(25), self._theta, np.zeros(8), 0.0, outcome, step)


class DropsAtOnce(TurnsBySwing):
    def step(self, action: np.ndarray) -> TimeStep:
        super().step(action)
        self._theta = 3.0
        return self._moment(15, DROPPED)


def worlds(kind: type[TurnsBySwing]) -> list[RotationEnv]:
    return [kind(), kind()]  # type: ignore[list-item]


def test_a_search_finds_what_turns_more_and_says_what_it_cost() -> None:
    said: list[str] = []
    booked: list[int] = []
    before = try_gait(worlds(TurnsBySwing), Gait(), seed=0)
    found = search_gait(worlds(TurnsBySwing), generations=6, population=6, seed=0, say=said.append, book=booked.append)
    assert found.best.score > 1.1 * before.score
    assert found.best.kept == 1.0
    assert found.tried == 36 + 4
    assert booked == [360, 720, 1080, 1440, 1800, 2160, found.steps]
    assert found.steps == 30 * 2 * found.tried
    assert len(said) == 6
    for name, (low, high) in BOUNDS.items():
        assert low <= getattr(found.best.gait, name) <= high


def test_equal_seeds_find_equal_gaits() -> None:
    one, two = (search_gait(worlds(TurnsBySwing), 2, 4, seed=3, say=lambda line: None).best for _ in range(2))
    assert one == two


def test_losing_the_object_halfway_leaves_a_quarter_of_the_angle() -> None:
    trial = try_gait(worlds(DropsAtOnce), Gait(), seed=0)
    assert (trial.angle, trial.kept) == (3.0, 0.0)
    assert trial.score == pytest.approx(0.75)


def test_what_is_written_are_ranges_that_demonstrations_can_draw_from(tmp_path: Path) -> None:
    found = search_gait(worlds(TurnsBySwing), 2, 4, seed=0, say=lambda line: None)
    write_gait(tmp_path / "gait.yaml", found, seed=0, costs=Costs(simulating=1800.0, wall=5400.0))
    written = yaml.safe_load((tmp_path / "gait.yaml").read_text())
    ranges = {key: value for key, value in written["gaits"].items() if key != "_target_"}
    drawn = GaitRanges(**ranges).draw(np.random.default_rng(0))
    assert drawn.phases == tuple(round(phase, 3) for phase in found.best.gait.phases)
    assert ranges["low"]["swing"] <= drawn.swing <= ranges["high"]["swing"]
    assert written["gaits_tried"] == found.tried
    search = {"name": tmp_path.name, "steps": found.steps, "cpu_hours": 0.5, "wall_hours": 1.5}
    assert ranges["search"].items() >= search.items()
