import math
from typing import Any

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Gait
from tactile_cube.hand.gait import GaitRanges, similar_gaits

RANGES = GaitRanges(low={"swing": 0.74, "period": 40}, high={"swing": 0.87, "period": 49})


def test_opposing_fingers_hold_while_the_others_are_in_the_air() -> None:
    gait = Gait()
    for step in range(gait.closing, gait.closing + 2 * gait.period):
        in_air = np.linalg.norm(gait.tips(step)[:, :2], axis=1) > 0.06
        assert in_air[0] == in_air[2]
        assert in_air[1] == in_air[3]
        assert not (in_air[0] and in_air[1])


def test_holding_tips_walk_in_minus_z() -> None:
    gait = Gait()
    before, after = gait.tips(gait.closing + 3), gait.tips(gait.closing + 4)
    turn = before[0, 0] * after[0, 1] - before[0, 1] * after[0, 0]
    assert turn < 0


def test_similar_gaits_differ_and_stay_in_the_action_range() -> None:
    actions = similar_gaits(DLR_HAND2, RANGES, number=3, steps=40, direction=-1)
    assert actions.shape == (3, 40, 12)
    assert np.abs(actions).max() <= 1.0
    assert np.abs(np.diff(actions, axis=0)).max(axis=(1, 2)).min() > 0.1
    np.testing.assert_array_equal(actions, similar_gaits(DLR_HAND2, RANGES, number=3, steps=40, direction=-1))


def test_an_episodes_actions_are_those_of_its_steps() -> None:
    gait = Gait(period=20)
    expected = [gait.action(DLR_HAND2, step) for step in range(60)]
    np.testing.assert_allclose(gait.actions(DLR_HAND2, 60), expected, atol=1e-12)


def test_ranges_that_no_gait_can_have_are_refused() -> None:
    with pytest.raises(InputError, match="stride"):
        GaitRanges(low={"stride": 0.1}, high={"stride": 0.2})
    with pytest.raises(InputError, match=r"low 0\.9 is above high 0\.8"):
        GaitRanges(low={"swing": 0.9}, high={"swing": 0.8})


@pytest.mark.parametrize(
    "wrong", [{"swing": "far"}, {"period": 0}, {"air_share": 1.0}, {"phases": (0.0, [1])}, {"height": math.inf}]
)
def test_what_no_clock_can_follow_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=f"gait.*{next(iter(wrong))}"):
        Gait(**wrong)
