"""In which worlds a policy loses its object."""

from dataclasses import replace

import numpy as np
import pytest

from tactile_cube.evaluation.summary import drawn, lost_where
from tactile_cube.evaluation.verdict import EpisodeResult, judge_episode
from tests.evaluation.synthetic import episode


def results(weight_matters: bool, count: int = 60) -> list[EpisodeResult]:
    """Episodes in worlds whose cube weighs 25 to 200 g, where those from 140 g on are lost, or any third one."""
    one, rng = judge_episode(episode()), np.random.default_rng(0)
    found = []
    for number, mass in enumerate(rng.uniform(0.025, 0.2, count)):
        lost = mass > 0.14 if weight_matters else number % 3 == 0
        world = {"seed": float(number), "cube_mass": mass, "cube_size": rng.uniform(0.07, 0.09), "kp": 3.7}
        found.append(replace(one, world=world, ending="dropped" if lost else "time_limit"))
    return found


def test_only_what_differs_between_the_worlds_was_drawn() -> None:
    assert drawn(results(True)) == ["cube_mass", "cube_size"]
    assert drawn([judge_episode(episode())] * 3) == []


def test_the_constant_that_tells_kept_from_lost_is_named() -> None:
    (where,) = lost_where(results(True))
    assert where.constant == "cube_mass"
    assert where.p_value < 1e-6
    assert where.episodes == (20, 20, 20)
    assert where.kept == (20, 19, 0)
    assert where.edges[0] == pytest.approx(0.025, abs=0.01)
    assert where.text.startswith("kept by cube_mass: 20 of 20 at 0.0")


def test_the_more_constants_were_drawn_the_less_one_of_them_tells() -> None:
    rng, two = np.random.default_rng(1), results(True)
    ten = [replace(one, world=one.world | {f"noise {k}": rng.normal() for k in range(8)}) for one in two]
    assert lost_where(ten)[0].p_value == pytest.approx(5 * lost_where(two)[0].p_value)


def test_nothing_is_named_where_nothing_tells() -> None:
    assert lost_where(results(False)) == []


@pytest.mark.parametrize(("lost", "named"), [(4, 0), (5, 1), (55, 1), (56, 0)])
def test_fewer_than_five_lost_or_kept_tell_nothing(lost: int, named: int) -> None:
    lightest_first = sorted(results(True), key=lambda one: one.world["cube_mass"])
    marked = [replace(one, ending="time_limit" if k < 60 - lost else "dropped") for k, one in enumerate(lightest_first)]
    assert len(lost_where(marked)) == named
