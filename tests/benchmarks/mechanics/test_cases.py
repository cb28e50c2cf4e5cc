"""What each engine does with a contact that has an answer from mechanics."""

import numpy as np
import pytest

from benchmarks.mechanics import CASES, Answer
from benchmarks.mechanics.case import Setting
from benchmarks.mechanics.page import mechanics_page
from benchmarks.mechanics.refinement import Outcome, Refinement
from tactile_cube.simulation import SimulationOptions

ENGINES = ("bullet", "mujoco")


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("case", ["twist", "hanging", "impact"])
def test_the_fast_setting_is_within_5_percent_of_mechanics(case: str, engine: str) -> None:
    assert abs(CASES[case](SimulationOptions(engine)).deviation) < 0.05  # type: ignore[arg-type]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_held_cube_creeps_less_than_a_quarter_of_a_millimetre_in_5_s(engine: str) -> None:
    assert CASES["creep"](SimulationOptions(engine)).measured < 0.25  # type: ignore[arg-type]


def test_sliding_and_spinning_share_one_limit_surface_in_mujoco_but_not_in_bullet() -> None:
    assert abs(CASES["slide_and_spin"](SimulationOptions("mujoco")).deviation) < 0.05
    # bounded each on its own, a contact bears up to sqrt(2) as much
    assert 0.2 < CASES["slide_and_spin"](SimulationOptions("bullet")).deviation < 0.42


def test_the_page_has_a_column_for_each_setting_and_says_where_mechanics_says_zero() -> None:
    answers = {"twist": Answer("weight", "N", 2.0, 2.1), "creep": Answer("way", "mm", 0.0, 0.2)}
    page = mechanics_page([Setting("mujoco fast", answers, 0.02)], [], "python -m x")
    assert "| twist: weight | 2 N | +5.0% |" in page
    assert "| creep: way | 0 mm | 0.200 mm |" in page


def test_refinement_changes_nothing_that_is_resolved_and_shows_what_is_not() -> None:
    def of(yaw: float) -> Outcome:
        return Outcome(np.zeros(3), np.ones(4), 0.4, np.array([[0.0, 0.0, 0.0], [yaw, 0.1, 0.01]]))

    row = mechanics_page([], [Refinement("mujoco", 3e-3, of(-1.0), of(-1.02))], "x")
    assert "| mujoco, 3 mm | 0.00 mm | 0.00 N | 0 mrad | 20 mrad (-1.02 rad) | 0 mrad (0.10 rad) | 0.0 mm |" in row
