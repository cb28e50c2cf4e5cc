"""Significance over blocks as long as the differences remember themselves."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from tactile_cube.identification.search.evidence import (
    Judgement,
    as_good,
    charged,
    correlation_length,
    in_blocks,
    lacking,
    likelihood,
    p_value,
    worse,
)
from tests.identification.test_verdict import MODEL, NOTHING, judged


def remembering(length: int, count: int = 600, seed: int = 0) -> np.ndarray:
    """Noise of which so many neighbours are the same."""
    return np.repeat(np.random.default_rng(seed).normal(size=count // length), length)


@pytest.mark.parametrize("length", [1, 4, 8])
def test_the_length_of_a_correlation_is_found(length: int) -> None:
    found = correlation_length(remembering(length), np.arange(600) // 100)
    assert 0.6 * length <= found <= 1.5 * length


def test_one_trial_does_not_remember_another() -> None:
    levels = np.repeat(np.random.default_rng(0).normal(size=60), 10)
    assert correlation_length(levels, np.arange(600)) == 1


def test_differences_are_held_against_their_scatter_from_block_to_block() -> None:
    before = Judgement(MODEL, np.full(5, 400.0), np.full(5, 100), NOTHING, np.ones(1), np.arange(5))
    after = replace(before, costs=before.costs - [20.0, 30.0, 50.0, 70.0, 110.0])
    assert p_value(before, after) == pytest.approx(float(ttest_1samp(likelihood(before, after), 0.0).pvalue / 2.0))
    assert p_value(after, before) > 0.9
    assert p_value(before, before) == 0.5
    few = replace(before, costs=before.costs[:4], samples=before.samples[:4], trial=before.trial[:4])
    steady = replace(few, costs=few.costs + np.array([390.0, 410.0, 400.0, 400.0]))
    assert (p_value(steady, few), worse(steady, few)) == (0.5, False), "four blocks prove nothing"
    assert not as_good(steady, few), "nor that twice the squared error is as good"


def test_the_same_difference_many_times_is_no_proof() -> None:
    before = judged(2.0)
    six = np.repeat([1.0, 0.8, 1.2, 0.9, -0.2, 1.1], 10) * 20.0
    slow = replace(before, costs=before.costs - six, trial=np.zeros(60, dtype=np.int64))
    fast = replace(slow, costs=before.costs - np.random.default_rng(1).permutation(six))
    assert p_value(before, fast) < 1e-6
    assert p_value(before, slow) > 1e3 * p_value(before, fast)


def test_blocks_keep_the_sum_and_do_not_cross_trials() -> None:
    one = replace(judged(2.0), trial=np.arange(60) // 15)
    difference = np.repeat([30.0, -10.0, 20.0, 5.0], 15) + np.random.default_rng(0).normal(size=60) * 0.01
    blocks = in_blocks(difference, one)
    assert blocks.sum() == pytest.approx(difference.sum())
    assert 4 <= len(blocks) < 20


def test_numbers_that_a_segment_chose_for_itself_are_charged_above_the_noise_alone() -> None:
    samples, numbers = np.array([400, 400, 400, 50]), np.array([0, 2, 2, 2])
    found = charged(np.array([4000.0, 4000.0, 390.0, 150.0]), samples, numbers)
    assert found[0] == 4000.0
    assert found[1] == pytest.approx(400.0 + 3600.0 * (8.0 / 6.0) ** 2), "eight of 400 samples are independent"
    assert found[2] == 390.0
    assert found[3] == pytest.approx(50.0 + 100.0 * 3.0**2), "a short segment has at least one more than it chose"


def test_an_effect_that_shows_in_fast_motion_alone_is_proven_by_each_segment_of_it() -> None:
    before = judged(2.0)
    motion = np.repeat([1.0, 12.0, 2.0, 9.0, 0.5, 4.0], 10) * np.random.default_rng(2).uniform(0.9, 1.1, 60)
    after = replace(before, costs=before.costs - motion, trial=np.zeros(60, dtype=np.int64))
    assert p_value(before, after) < 1e-9, "sizes that follow the motion are no dependence"


def test_trials_in_which_nothing_moves_do_not_hide_what_the_others_show() -> None:
    rng, before = np.random.default_rng(3), judged(2.0)
    moving, still = rng.uniform(20.0, 300.0, 24), np.repeat([-0.3, 0.2, -0.4], 12) * rng.uniform(0.5, 1.5, 36)
    difference, trial = np.concatenate([moving, still]), np.arange(60) // 12
    assert correlation_length(difference, trial) > 5, "the still ones alone would make blocks of half a trial"
    after = replace(before, costs=before.costs - difference, trial=trial)
    assert p_value(before, after) < 1e-4
    assert p_value(before, replace(after, costs=before.costs - 0.002 * difference)) > 1e-3, "slight everywhere"
    assert len(in_blocks(10.0 * difference, after)) == len(moving), "a hundredth of the largest is noise, however large"


def test_segments_at_rest_in_which_a_model_rests_too_are_no_infinite_proof() -> None:
    before = judged(20.0)
    resting = np.arange(60) < 10
    after = replace(before, costs=np.where(resting, 0.0, before.costs / 9.0))
    assert np.isfinite(likelihood(before, after)).all()
    assert p_value(before, after) < 1e-6, "the sixth that rests hides nothing of what the others prove"
    assert likelihood(before, after)[resting].max() < 10.0 * likelihood(before, after)[~resting].max()


def test_what_a_larger_set_proves_a_smaller_one_lacks() -> None:
    less = judged(10.0)
    scatter = 1.0 + 0.1 * np.random.default_rng(0).normal(size=60)
    assert lacking(less, replace(less, costs=less.costs * 0.89 * scatter)), "a tenth, and steadily"
    assert not lacking(less, replace(less, costs=less.costs * 0.97)), "below the price of an effect"
    once = np.where(np.arange(60) < 3, 0.01, 1.0)
    assert not lacking(less, replace(less, costs=less.costs * once)), "three segments of sixty"
    doubtful = replace(less, costs=less.costs * 0.89 * np.exp(0.3 * np.random.default_rng(0).normal(size=60)))
    assert lacking(less, doubtful)
    assert not lacking(less, doubtful, looked_at=60), "one of sixty laws does as much by chance"
