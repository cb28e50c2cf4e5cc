from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.search.residual_shape import Missing, black_box, missing_torques, shapes
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import NOISE, Size, simulated

RNG = np.random.default_rng(2)
POSITION, SPEED = RNG.uniform(-1, 1, 8000), RNG.normal(size=8000)
SEGMENT = np.repeat(np.arange(80), 100)


def missing(torque: np.ndarray) -> Missing:
    return Missing("q1", torque, {"position of q1 [rad]": POSITION, "velocity of q1 [rad/s]": SPEED}, SEGMENT, SEGMENT)


def test_the_signal_that_the_torque_depends_on_comes_first() -> None:
    best = shapes(missing(0.02 * np.abs(POSITION) + 0.001 * RNG.normal(size=8000)))[0]
    assert best.against == "position of q1 [rad]"
    assert best.explained > 0.9
    assert best.mean[0] > best.mean[len(best.mean) // 2]


def test_friction_that_depends_on_the_place_has_a_curve_for_each_direction() -> None:
    best, second, *others = shapes(missing(-0.02 * np.abs(POSITION) * np.sign(SPEED) + 0.001 * RNG.normal(size=8000)))
    assert {best.against, second.against} == {f"position of q1 [rad], moving {side}" for side in ("up", "down")}
    assert best.explained == second.explained > 0.9
    assert all(one.explained < 0.85 for one in others)
    rising = best if best.against.endswith("up") else second
    assert rising.mean[0] == pytest.approx(-0.02, abs=0.003)
    assert rising.mean[len(rising.mean) // 2] == pytest.approx(0.0, abs=0.003)


def test_a_torque_that_no_direction_matters_to_has_one_curve_a_signal() -> None:
    assert all("moving" not in one.against for one in shapes(missing(0.02 * POSITION)))


def test_a_black_box_finds_a_law_of_two_signals() -> None:
    assert black_box(missing(0.02 * POSITION * SPEED)) > 0.8


def test_a_black_box_finds_nothing_in_noise() -> None:
    assert black_box(missing(RNG.normal(size=8000))) == pytest.approx(0.0, abs=0.05)


def test_rows_that_do_not_count_put_no_torque_beside_them(tmp_path: Path) -> None:
    recording = simulated(tmp_path, Size(), find_effect("coulomb_friction"), {"friction": 0.16})
    trials = [replace(trial, valid=trial.valid & (trial.time >= 0.4)) for trial in recording.trials]
    largest = []
    for one in (recording, replace(recording, trials=tuple(trials))):
        search = Search(*held_out_split(one), np.full(1, NOISE), (), lambda line: None)
        model, problem = search.start, search.problem
        (missing,) = missing_torques(problem, search.fitted, model, problem.residual(problem.prediction(model)))
        largest.append(np.abs(missing.torque).max())
    assert largest[1] < 1.1 * largest[0]
