import numpy as np

from tactile_cube.simulation import EpisodeConstants
from tactile_cube.simulation.world import random_wrench

FOLLOW_UP = EpisodeConstants(force_mean=0.04, force_std=0.008, torque_mean=0.002, torque_std=0.0004)


def test_without_sizes_there_is_none() -> None:
    assert random_wrench(EpisodeConstants(), 1.0) is None


def test_it_is_redrawn_every_half_second_and_constant_between() -> None:
    wrenches = [random_wrench(FOLLOW_UP, 0.1 * k) for k in range(11)]
    for k in range(1, 11):
        assert np.array_equal(wrenches[k], wrenches[k - 1]) == (k % 5 != 0)


def test_sizes_follow_the_given_distributions() -> None:
    drawn = np.array([random_wrench(FOLLOW_UP, 0.5 * k) for k in range(600)])
    force, torque = np.linalg.norm(drawn[:, :3], axis=1), np.linalg.norm(drawn[:, 3:], axis=1)
    assert abs(force.mean() - 0.04) < 0.001
    assert abs(force.std() - 0.008) < 0.001
    assert abs(torque.mean() - 0.002) < 5e-5
    assert abs(torque.std() - 0.0004) < 5e-5
    ways = np.hstack([drawn[:, :3] / force[:, None], drawn[:, 3:] / torque[:, None]])
    assert np.abs(ways.mean(axis=0)).max() < 0.07
    assert np.abs(np.corrcoef(ways.T) - np.eye(6)).max() < 0.15, "every way is as likely, those of the torque apart"
