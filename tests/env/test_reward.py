import numpy as np
import pytest

from tactile_cube.env import BORNE_TERMS, REWARD_TERMS, CubePose, Reward
from tactile_cube.env import reward as terms
from tactile_cube.errors import InputError

STILL = CubePose(0, 0, 0, 0, 0, 0, 0)


def test_spin_counts_in_the_rewarded_direction_and_is_clipped_there_only() -> None:
    turned = STILL._replace(theta=0.05)
    assert terms.spin(STILL, turned, 1, 0.1) == pytest.approx(0.05)
    assert terms.spin(STILL, turned, -1, 0.1) == pytest.approx(-0.05)
    assert terms.spin(STILL, STILL._replace(theta=0.3), 1, 0.1) == pytest.approx(0.1)
    assert terms.spin(STILL, STILL._replace(theta=0.3), -1, 0.1) == pytest.approx(-0.3)


def test_motion_terms_measure_the_change_of_a_step() -> None:
    before = CubePose(0.1, 0.1, 0.1, 0, 0.15, 0.1, 0)
    after = CubePose(0.103, 0.096, 0.098, 0, 0.1, 0.08, 0)
    assert terms.plane(before, after) == pytest.approx(0.005)
    assert terms.height(before, after) == pytest.approx(0.002)
    assert terms.tilt(before, after) == pytest.approx(0.07)
    assert terms.plane(after, after) == terms.height(after, after) == terms.tilt(after, after) == 0.0


def test_proximal_term_sums_the_fourth_power_of_each_fingers_first_joint() -> None:
    angles = np.full(12, 9.0)
    angles[::3] = (0.1, -0.2, 0.3, 0.0)
    assert terms.proximal(angles.tolist()) == pytest.approx(0.1**4 + 0.2**4 + 0.3**4)


def test_off_centre_is_the_squared_horizontal_distance_from_the_start() -> None:
    assert terms.off_centre(STILL._replace(x=0.1, y=0.1), STILL._replace(x=0.13, y=0.06, z=0.5)) == pytest.approx(
        0.0025
    )


def test_advance_counts_fingers_that_go_back_and_not_those_that_turn_with_the_object() -> None:
    tips = np.array([-1.5, 0.0, 1.5, 3.1])
    assert terms.advance(0.1, -1, tips, tips - 0.1) == pytest.approx(0.0)
    assert terms.advance(0.0, 1, tips, tips + np.array([0.3, 0.0, 0.0, 0.0])) == pytest.approx(-0.3)
    assert terms.advance(0.05, 1, tips, tips) == pytest.approx(0.2)
    assert terms.advance(0.0, -1, np.array([3.1]), np.array([3.1]) + 0.3 - 2 * np.pi) == pytest.approx(0.3)
    assert terms.advance(0.0, -1, np.array([-3.1]), np.array([-3.1]) - 0.3 + 2 * np.pi) == pytest.approx(-0.3)
    assert terms.advance(0.0, -1, np.zeros(0), np.zeros(0)) == 0.0


def test_climb_is_the_squared_height_above_the_start_and_a_lower_object_costs_nothing() -> None:
    assert terms.climb(STILL._replace(z=0.01), STILL._replace(z=0.03, x=0.5)) == pytest.approx(4e-4)
    assert terms.climb(STILL, STILL._replace(z=-0.03)) == 0.0


def test_terms_of_how_the_object_is_held_are_there_only_with_a_weight() -> None:
    assert Reward().terms == REWARD_TERMS
    held = Reward(climb=400, link_spin=8, tips=0.25, links=0.5, link_force=2)
    assert held.terms == REWARD_TERMS + BORNE_TERMS
    assert held.weights().tolist() == [*Reward().weights().tolist(), -400, -8, 0.25, -0.5, -2]


def test_published_weights_and_their_signs() -> None:
    assert Reward().weights().tolist() == [16, -100, -300, -50, -25, 0, -10, 0]
    assert Reward().fastest == 1.0, "[rad/s]"


def test_penalty_scale_changes_the_motion_weights_only() -> None:
    ratio = Reward(off_centre=1.0, advance=1.0).weights(0.2) / Reward(off_centre=1.0, advance=1.0).weights()
    scaled = {name for name, r in zip(REWARD_TERMS, ratio, strict=True) if r != 1.0}
    assert scaled == {"height", "plane", "tilt"}
    assert ratio[1:4] == pytest.approx([0.2] * 3)


def test_negative_weight_is_refused_because_signs_are_built_in() -> None:
    with pytest.raises(InputError, match=r"reward\.plane is -300"):
        Reward(plane=-300)
