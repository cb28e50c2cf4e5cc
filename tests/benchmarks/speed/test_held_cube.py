"""The simulations that are compared do the same work: all of them hold the cube."""

import itertools

import numpy as np
import pytest

from benchmarks.speed.held_cube import Holding, creep, motion, our_world
from benchmarks.speed.mujoco_hand import MujocoHand
from benchmarks.speed.naive_pybullet import NaivePyBullet
from tactile_cube.simulation import EpisodeConstants, SimulationOptions


def naive() -> Holding:
    return NaivePyBullet(EpisodeConstants())


def in_mujoco() -> Holding:
    return MujocoHand(pytest.importorskip("mujoco"), EpisodeConstants(), impratio=10.0, noslip=0)


def ours() -> Holding:
    return our_world(SimulationOptions())


@pytest.mark.parametrize("make", [ours, naive, in_mujoco])
def test_the_cube_stays_between_the_fingers(make: object) -> None:
    holding = make()  # type: ignore[operator]
    assert creep(holding) < 2e-3
    assert np.linalg.norm(holding.cube_position) < 0.01


def test_the_motion_turns_to_and_fro_and_repeats() -> None:
    steps = list(itertools.islice(motion(), 80))
    assert np.array_equal(steps[0], steps[40])
    assert not np.allclose(steps[0], steps[10], atol=0.01)
